"""Fits the numbers of `deixis_tracker/skin_prior.py` and prints them.

    python fit_skin_prior.py Skin_NonSkin.txt CLIPS

reads the UCI Skin Segmentation set (text, B G R label; CC BY 4.0) and a folder of labelled clips (NAME.mp4 with
NAME_labels.npz, PNG label images with the skin bit 16), and fits one mixture of Gaussians to skin and one to everything
else in the space of `deixis_tracker.skin.chroma_features`. Both sources weigh the same. Deterministic.
"""

from __future__ import annotations

import sys
from pathlib import Path

import cv2
import numpy as np
from deixis_tracker.skin import Array, chroma_features, gaussian_densities

FRAMES_PER_CLIP = 3
PIXELS_PER_FRAME = 2000
SKIN_BIT = 16


def read_uci(path: Path) -> tuple[Array, Array]:
    """(skin, other) colours of the UCI set, each (N, 3) BGR."""
    table = np.loadtxt(path, dtype=np.int64)
    return table[table[:, 3] == 1, :3].astype(float), table[table[:, 3] == 2, :3].astype(float)


def read_clip(path: Path, rng: np.random.Generator) -> tuple[Array, Array]:
    """(skin, other) colours of some frames of one labelled clip."""
    labels = np.load(path.with_name(path.stem + "_labels.npz"))
    names = sorted(labels.files)
    capture = cv2.VideoCapture(str(path))
    skin: list[Array] = []
    other: list[Array] = []
    for index in np.linspace(0, len(names) - 1, FRAMES_PER_CLIP).astype(int):
        capture.set(cv2.CAP_PROP_POS_FRAMES, int(index))
        image = np.asarray(capture.read()[1], np.uint8).reshape(-1, 3)
        label = np.asarray(cv2.imdecode(labels[names[index]], cv2.IMREAD_UNCHANGED), np.int64)
        is_skin = (label & SKIN_BIT).reshape(-1) > 0
        for pixels, kept in ((image[is_skin], skin), (image[~is_skin], other)):
            if len(pixels):
                kept.append(rng.choice(pixels, min(PIXELS_PER_FRAME, len(pixels)), replace=False).astype(float))
    return (np.concatenate(skin) if skin else np.empty((0, 3))), np.concatenate(other)


def fit_mixture(x: Array, count: int, rng: np.random.Generator) -> list[tuple[float, Array, Array]]:
    """Expectation maximisation of `count` Gaussians: (weight, mean, covariance) of each."""
    means = x[rng.choice(len(x), count, replace=False)]
    covariances = np.stack([np.cov(x.T)] * count)
    weights = np.full(count, 1 / count)
    for _ in range(60):
        densities = np.stack([w * gaussian_densities(x, m, c) for w, m, c in zip(weights, means, covariances, strict=True)])
        share = densities / np.maximum(densities.sum(axis=0), 1e-300)
        mass = share.sum(axis=1) + 1e-9
        means = (share @ x) / mass[:, None]
        for k in range(count):
            offset = x - means[k]
            covariances[k] = (offset * share[k][:, None]).T @ offset / mass[k] + 1e-4 * np.eye(3)
        weights = mass / mass.sum()
    return list(zip(weights.tolist(), means, covariances, strict=True))


def main(uci: str, clips: str) -> None:
    """Print the fitted mixtures as Python."""
    rng = np.random.default_rng(11)
    sources = [
        read_uci(Path(uci)),
        tuple(map(np.concatenate, zip(*(read_clip(p, rng) for p in sorted(Path(clips).glob("*.mp4"))), strict=True))),
    ]
    for name, which, count in (("SKIN", 0, 4), ("OTHER", 1, 8)):
        x = chroma_features(np.concatenate([rng.choice(source[which], 15000) for source in sources]))
        print(f"{name}: tuple[Gaussian, ...] = (")
        for weight, mean, covariance in fit_mixture(x, count, rng):
            rows = tuple(tuple(float(f"{v:.4g}") for v in row) for row in covariance)
            print(f"    Gaussian({weight:.3f}, {tuple(float(f'{v:.4g}') for v in mean)}, {rows}),")
        print(")")


if __name__ == "__main__":
    main(*sys.argv[1:])
