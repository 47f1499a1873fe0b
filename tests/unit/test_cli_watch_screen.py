"""What `deixis watch` draws on a terminal."""

import io

import pytest
from deixis_cli.summary import Summary
from deixis_cli.watch_screen import STALE_S, WatchScreen
from deixis_schemas.messages import Belief, Health, OutputHealth, PersonBelief, PoiBelief, Target
from rich.console import Console

NAMES = {"P1": "the vase", "P2": "the ship"}
OF_FRAME = {"run": 1, "seq": 7, "stamp_ns": 1_000_000_000, "stage": "fusion", "instance": "a"}


def poi(poi_id, probability):
    return PoiBelief(poi_id=poi_id, mass=0, belief=0, plausibility=1, pignistic=probability, probability=probability)


def person(number=0, **more):
    told = {"pois": [poi("P1", 0.2), poi("P2", 0.7)], "unknown": 0.05, "distance_m": 1.94}
    return PersonBelief(person_id=number, **(told | more))


def health(**more):
    told = {"stage": "tracker", "instance": "a", "stamp_ns": 1, "count": 1, "state": "ok", "pid": 1, "host": "h"}
    numbers = {"uptime_s": 1, "cpu_s": 1, "rss_mb": 1, "step_ms_p50": 12.4, "outputs": [OutputHealth(key="k", rate_hz=29.6)]}
    return Health(**(told | numbers | more))


class Drawn:
    """A screen with a clock of the test's, and its picture as text."""

    def __init__(self, width=100):
        self.now_s = 100.0
        self.console = Console(file=io.StringIO(), width=width, force_terminal=True, color_system=None)
        self.screen = WatchScreen(self.console, "r1", Summary(dict(NAMES)), clock=lambda: self.now_s)

    def text(self):
        with self.console.capture() as captured:
            self.console.print(self.screen.picture())
        return captured.get()

    def row(self, begins):
        (found,) = [line for line in self.text().splitlines() if line.startswith(begins)]
        return found


@pytest.fixture
def drawn():
    return Drawn()


def belief(*persons):
    return Belief(**OF_FRAME, persons=list(persons))


def test_the_likeliest_poi_comes_first_with_the_longest_bar(drawn):
    drawn.screen.hear(belief(person(episode_id="e")))
    lines = drawn.text().splitlines()
    (title,) = [line for line in lines if line.startswith("person 0")]
    assert title.strip() == "person 0 points, 1.9 m away"
    assert (
        lines.index(drawn.row("the ship (P2)")) < lines.index(drawn.row("the vase (P1)")) < lines.index(drawn.row("not known"))
    )
    assert drawn.row("the ship").rstrip().endswith("0.70")


def test_head_and_hand_that_disagree_are_said(drawn):
    drawn.screen.hear(belief(person(contour_conflict=0.97)))
    assert "head and hand disagree (0.97)" in drawn.row("person 0 does not point")


def test_persons_beyond_the_first_are_counted(drawn):
    drawn.screen.hear(belief(*(person(number) for number in range(5))))
    assert "and 2 more" in drawn.text()


def test_beliefs_that_stopped_are_not_shown_as_if_they_were_of_now(drawn):
    drawn.screen.hear(belief(person()))
    drawn.now_s += STALE_S + 0.1
    assert "the ship" not in drawn.text()
    assert "no beliefs come" in drawn.text()


def test_a_stage_shows_its_state_rate_and_cause_and_silence_counts_up(drawn):
    assert drawn.row("tracker").split() == ["tracker", "-"]
    drawn.screen.hear(health(state="degraded", reason="the picture is dark"))
    assert drawn.row("tracker").split() == ["tracker", "degraded", "30", "12", "the", "picture", "is", "dark"]
    drawn.now_s += 5
    assert drawn.row("tracker").split()[:2] == ["tracker", "silent"]
    assert "for 5 s" in drawn.row("tracker")


@pytest.mark.parametrize("width", [40, 100])
@pytest.mark.parametrize(("poi_ids", "said"), [(["P2"], "the ship (P2), 0.70"), ([], "no answer")])
def test_a_pointing_that_ended_stays_whole_however_narrow_the_terminal(poi_ids, said, width):
    drawn = Drawn(width)
    times = {"started_ns": 2_000_000_000, "ended_ns": 3_200_000_000, "latency_ms": 1}
    reason = " ".join(f"because {number}" for number in range(12))
    with drawn.screen:
        drawn.screen.hear(
            Target(
                **OF_FRAME, **times, episode_id="e", person_id=4, final=True, poi_ids=poi_ids, pois=[poi("P2", 0.7)],
                conflict=0, reason=reason,
            )
        )  # fmt: skip
    text = " ".join(drawn.console.file.getvalue().split())
    assert text.count("person 4") == 1
    assert f"person 4, 1.2 s: {said}" in text
    assert reason in text
