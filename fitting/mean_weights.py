"""Mixes two files of weights of head pose, of which the second was fitted on from the first: a mean, weight by weight.

usage: python fitting/mean_weights.py FIRST SECOND --share S --out FILE

A refit reads better what it was fitted for, and worse a few of the people whom the weights before it read well. Between the
two lies a network that does most of both (Wortsman et al. 2022, "Robust fine-tuning of zero-shot models"), at no cost; it is
chosen on the choosing seeds. Weights of two fits that began anew cannot be mixed: their units have nothing in common.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Arrays = dict[str, NDArray[Any]]


def main() -> int:
    """Read, mix, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("first", type=Path, help="weights (.npz)")
    parser.add_argument("second", type=Path, help="weights (.npz) that were fitted on from the first")
    parser.add_argument("--share", type=float, required=True, help="of the second, 0 to 1")
    parser.add_argument("--out", type=Path, required=True, help="file of weights to write")
    given = parser.parse_args()
    try:
        first, second = (dict(np.load(path, allow_pickle=False)) for path in (given.first, given.second))
        mixed: dict[str, Any] = mean_of(first, second, given.share)
    except (OSError, ValueError) as error:
        print(f"mean_weights: {error}", file=sys.stderr)
        return 2
    np.savez_compressed(given.out, **mixed)
    return 0


def mean_of(first: Arrays, second: Arrays, share: float) -> Arrays:
    """`share` of the second's weights and the rest of the first's. Raises ValueError where they are not of one network."""
    if not 0 <= share <= 1:
        raise ValueError(f"--share {share:g} is not within 0 and 1")
    shapes = [{name: values.shape for name, values in arrays.items()} for arrays in (first, second)]
    if shapes[0] != shapes[1]:
        raise ValueError("these are not weights of the same network")
    mixed = {name: (1 - share) * first[name].astype(np.float32) + share * second[name].astype(np.float32) for name in first}
    return {name: values.astype(first[name].dtype) for name, values in mixed.items()}


if __name__ == "__main__":
    raise SystemExit(main())
