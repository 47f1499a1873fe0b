"""Writes `services/fusion/deixis_fusion/fig_6.yaml`: figure 6 of the paper, reconstructed.

usage: python fitting/reconstruct_fig_6.py

Its numbers are not published. What the text says: columns sum to 1, success is high at small angles and falls, above 50 % up
to 120 degrees; a head that cannot be read is "not computed". What table 3 says: of heads within the range 1 to 4 % do not lead
to the right POI (C_f beside V_f), and POIs lie farther apart than a step of 10 degrees: so "not computed" is rare within the
range, and the rest is neighbours.
The straight line between is a choice. `python fitting/choose_paper.py` chose success at 120 degrees and how much is unread.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

TARGET = Path(__file__).parents[1] / "services/fusion/deixis_fusion/fig_6.yaml"
INTENDED = range(0, 190, 10)
PERCEIVED = range(0, 130, 10)
AT_FRONT, AT_LIMIT = 0.95, 0.6
"""Success at 0 and at 120 degrees."""
UNREAD = 0.05
"""Part of the errors that are no neighbour but "not computed"."""
HEAD = """\
# Figure 6 of Pateraki et al. 2011, P(perceived yaw | intended yaw), by size: left and right are alike. Its numbers are not
# published: this is a reconstruction from what text and table 3 say, by `python fitting/reconstruct_fig_6.py` (see there).
# One row for each perceived yaw and one number in it for each intended yaw; the columns sum to 1 with `not_computed`.
source: reconstruction of figure 6, Pateraki et al. 2011, whose numbers are not published
"""


def reconstructed(at_limit: float = AT_LIMIT, unread: float = UNREAD) -> npt.NDArray[np.float64]:
    """Shares (perceived + 1, intended); the last row is "not computed", all that there is beyond the range (section 6.2)."""
    rows = {yaw: i for i, yaw in enumerate(PERCEIVED)}
    table = np.zeros((len(rows) + 1, len(INTENDED)))
    for column, intended in enumerate(INTENDED):
        if intended in rows:
            success = AT_FRONT + (at_limit - AT_FRONT) * intended / max(PERCEIVED)
            neighbours = [yaw for yaw in (intended - 10, intended + 10) if yaw in rows]
            table[rows[intended], column] = success
            for yaw in neighbours:
                table[rows[yaw], column] = (1 - unread) * (1 - success) / len(neighbours)
    table = table.round(4)
    table[-1] = (1 - table.sum(axis=0)).round(4)
    return table


def main() -> int:
    """Write the file."""
    table = reconstructed()
    lines = [HEAD, f"intended_deg: [{', '.join(map(str, INTENDED))}]\n", f"perceived_deg: [{', '.join(map(str, PERCEIVED))}]\n"]
    lines += ["table:\n", *(f"  - [{', '.join(f'{share:g}' for share in row)}]\n" for row in table[:-1])]
    lines.append(f"not_computed: [{', '.join(f'{share:g}' for share in table[-1])}]\n")
    TARGET.write_text("".join(lines), encoding="utf-8")
    print(f"wrote {TARGET}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
