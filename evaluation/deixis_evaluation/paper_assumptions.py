"""What the paper leaves open and what was assumed for it, in sentences: wherever its tables are shown, these "
"go with them.
"""

from __future__ import annotations

from .paper_arrangements import CLEARANCE_M, FARTHEST_M, NEAREST_M, OFF_WALL_M
from .paper_rooms import ROOMS
from .paper_simulation import Study
from .paper_trials import HAND_SIGMA_DEG


def assumptions(study: Study) -> list[str]:
    """All that bears on this study."""
    found = [*_of_rooms(), *_of_rules(study)]
    if study.mode == "deixis" or study.mismatch > 0:
        found.append(
            "deixis, on the same trials: the rules of the fusion stage as set, and what its stages tell beyond "
            "the paper: with a "
            f"pointing finger the hand's bearing, off by {HAND_SIGMA_DEG:g} degrees (standard deviation, which "
            "is what the gesture "
            "stage errs by on people held out), front and back alike; with a head not computed, the side it is turned to. "
            "deixis_paper_readings is without these two. Places are known exactly. ideal and ideal_paper_readings name the "
            "likeliest POI by Bayes' rule on the readings of each, knowing how these are drawn: no rules have a higher Cors "
            "but by chance."
        )
    if study.mismatch > 0:
        found.append(
            f"Mismatch: in {study.mismatch:.0%} of the trials, at random, the head looks at the robot while the "
            "hand points at the "
            "POI. dempster to pcr6 combine the paper's masses; dempster_discounted discounts them first, by the "
            "fusion stage's own "
            "rates. All visible POIs together count as no answer. Tables 1 to 3 are without mismatch."
        )
    return found


def _of_rooms() -> list[str]:
    return [
        "The rooms are shown in figures 7 and 8 only; they are reconstructed from the text. "
        + " ".join(f"{room.name}: {room.about}." for room in ROOMS),
        f"Robot and person stand anywhere on the floor, {OFF_WALL_M:g} m off the walls and {NEAREST_M:g} to "
        f"{FARTHEST_M:g} m "
        "apart, where they see each other and both see a POI. The person faces the robot. Size and distance are "
        "those that come "
        "nearest to table 3 in A and B (python fitting/choose_paper.py).",
        f"Visible is what no wall hides from the robot nor from the person (but for the last {CLEARANCE_M:g} "
        "m), all around them.",
    ]


def _of_rules(study: Study) -> list[str]:
    paper, confusion = study.config.paper, study.config.confusion
    return [
        f"Table 1: {confusion.hand.source or 'as set'}.",
        f"Figure 6: {confusion.head.source or 'as set'}. Between its columns it goes on a line; left and right "
        "are alike; a head "
        "is read as one of its rows.",
        f"phi_f-max, never given, is {paper.phi_f_max_deg:g} degrees. Text and table 3 allow for 100 to 131.",
        f"phi_h-min and phi_h-max are {paper.phi_h_min_deg:g} and {paper.phi_h_max_deg:g} degrees; section 6.1 swaps them.",
        "Eq. 16 sums over the actual gestures, not over the recognised ones as printed. P(G) counts POIs and "
        "eq. 18 weighs each: "
        "priors enter twice, as in the paper.",
        "Eq. 18 has the likelihoods of figure 6, 'not computed' being one of its rows; the POIs beyond "
        "phi_f-max share one mass, "
        "m_f-O (eq. 17).",
        "The answer is the union of the focal sets of largest mass, of whatever size: masses of sets are "
        "compared with those of "
        "single POIs. A reading that no POI explains, and total conflict (K = 0), are left undefined: mass 1 on all POIs.",
        "C_h: the gesture was recognised rightly and one POI lies in that region. C_f: the head was computed, "
        "and by m_f alone "
        "the POI meant is best.",
    ]
