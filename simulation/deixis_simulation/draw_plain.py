"""Plain scenes: one standing person, rarely two, before an upright camera that stands, in steady light and a simple room.

As the labelled clips have them that Deixis was first measured on: their lenses, walls, gestures and directions. Who it is,
where exactly, and when, is drawn.
"""

from __future__ import annotations

from .draw_actions import Habits
from .draw_lens import Optics
from .draw_light import Lamps
from .draw_manner import Manner
from .draw_mount import Mounts
from .draw_plan import Plots
from .draw_pois import Spread
from .draw_room import Rooms
from .draw_stand import Stands
from .framing import Frame

GAPS_DEG = (10.0, 15.0, 22.0, 30.0)
REACH_DEG = 130.0
"""How far from the camera's direction people point."""
FRONT_DEG = 5.0
ASPECT = 3 / 4
"""Heights of the pictures, by their width: wider ones cut heads off."""

PLAIN = Manner(
    letter="p",
    child_share=0.0,
    plots=Plots(
        kinds={"point": 0.44, "quiet": 0.24, "several": 0.08, "walk": 0.1, "turn": 0.14},
        of_kind={
            "point": {"point": 1.0},
            "quiet": {"gestures": 0.64, "idle": 0.18, "empty": 0.18},
            "several": {"point": 1.0},
            "walk": {"through": 1.0},
            "turn": {"turns": 0.7, "nods": 0.3},
        },
        moves={"none": 1.0},
        company={2: 1.0},
        in_a_row={1: 0.5, 2: 0.5},
        two_pointings=0.15,
        gesture_before=0.0,
        second_pointer=0.0,
        hand_may_leave=0.0,
    ),
    stands=Stands(
        aside=0.12,
        mostly_near=True,
        front_deg=(3, FRONT_DEG),
        turned=0.0,
        others_aside=0.34,
        others_distance_m=(1.6, 3.5),
        apart_m=0.8,
        clear_m=0.35,
        carries=0.0,
    ),
    spread=Spread(
        within_deg=REACH_DEG + 12,
        gaps_deg=GAPS_DEG,
        distance_m=(1.7, 2.5),
        height_m=(1.1, 1.4),
        seen_from_deg=50.0,
        seen_gap_deg=25.0,
        always_seen=False,
    ),
    habits=Habits(
        arm_reach_deg=REACH_DEG - FRONT_DEG,
        looks_away=0.0,
        styles={"straight": 0.65, "bent": 0.35},
        hands={"index": 1.0},
        move_s=(0.45, 0.65),
        shortest_hold_s=1.3,
        # Four heads of five turn all the way, as ten of the twelve pointing people of those clips do.
        head_gain=(0.7, 2.2),
        most_head_gain=1.0,
        head_lag_s=(-0.12, 0.05),
        head_overshoot_deg=(0, 4),
        torso_gain=(0.8, 1.2),
        pronation_deg=(20, 70),
        gestures=("wave", "stop", "facepass", "drink", "chin", "scratch", "hair", "glasses"),
        quiet_move_s=(0.45, 0.65),
        quiet_hold_s=(1.4, 2.2),
        rate_hz=(1.6, 2.4),
        turn_deg=(20.0, 95.0),
        turn_s=(0.55, 0.95),
        turn_hold_s=(0.35, 0.7),
    ),
    mounts=Mounts(
        height_m=(1.2, 1.4),
        looks_above_m=(0.0, 0.13),
        tilt_deg=(0.5, 1.5),
        level_deg=(0.3, 1.0),
        aslant=0.0,
        frame=Frame(lowest_aspect=ASPECT, margin=0.09, nearest_m=0.8),
    ),
    optics=Optics(
        sizes={(640, 480): 1.0},
        fov_deg=(58.0, 70.0),
        exposure=(0.9, 1.1),
        per_shutter_s=(55, 65),
        noise=(1.0, 1.8),
        blur_px=(0.5, 0.65),
        sharpening=(0.35, 0.9),
        saturation=(0.95, 1.05),
        contrast=(0.05, 0.2),
        cast=(0.02, 0.05),
        green=(0.0, 0.0),
        quality_crf=(18, 22),
    ),
    lamps=Lamps(
        presets={"office": 0.68, "window_left": 0.1, "window_right": 0.1, "warm": 0.06, "hard": 0.06},
        red=(0.98, 1.02),
        blue=(0.98, 1.02),
        change_share=0.0,
        flicker_share=0.0,
    ),
    rooms=Rooms(
        walls={"plaster": 0.85, "brick": 0.15},
        floors={"wood": 0.5, "carpet": 0.5},
        paints={
            "plaster": ((205, 203, 196), (150, 156, 164), (112, 140, 182), (176, 162, 138)),
            "brick": ((158, 104, 84),),
        },
        floor_paints={"wood": ((128, 92, 62),), "carpet": ((92, 94, 98), (122, 120, 116))},
        furniture=("door", "cabinet", "books", "board", "poster", "plant", "window", "cardboard"),
        pieces=(2, 4),
        furniture_tinted=0.0,
    ),
)
