"""What a router says of its links and its certificate while it runs."""

import logging
import os
import time
from datetime import timedelta

import pytest
from deixis_runtime.certificate_check import DAY_S
from deixis_runtime.finding import Finding
from deixis_runtime.link_watch import (
    DATES_EVERY_S,
    EXPLAIN_AFTER_S,
    EXPLAIN_EVERY_S,
    NOTE_EVERY_S,
    WRONG_EVERY_S,
    CertificateWatch,
    LinkWatch,
)
from site_made import add, make_site

NOW_S = time.time()
EDGE = "tls/edge:7447"


@pytest.fixture
def robot(tmp_path):
    return add(make_site(tmp_path / "site"), "robot:r1", lasts=timedelta(days=100))


def said(watch, hours, days):
    """Levels that are said by a watch that is asked each second for so many hours, so many days from now."""
    began_s = days * DAY_S
    found = [watch.turn(began_s + 60 * minute, NOW_S + began_s + 60 * minute) for minute in range(hours * 60)]
    return [item.level for item in found if item is not None]


def test_a_certificate_that_holds_is_not_worth_a_word(robot):
    assert said(CertificateWatch(robot), hours=48, days=0) == []


def test_one_that_expires_soon_is_noted_once_a_day(robot):
    watch = CertificateWatch(robot)
    assert said(watch, hours=72, days=80) == ["note"] * 3


def test_one_that_has_expired_is_an_error_once_an_hour_and_at_once(robot):
    watch = CertificateWatch(robot)
    assert said(watch, hours=1, days=99) == ["note"]
    assert said(watch, hours=3, days=101) == ["wrong"] * 3


def test_a_renewed_certificate_and_a_changed_list_are_noted_until_the_process_is_begun_anew(robot):
    watch = CertificateWatch(robot)
    assert watch.turn(0, NOW_S) is None
    os.utime(robot.access, (1, 1))
    changed = watch.turn(DATES_EVERY_S, NOW_S)
    assert changed.level == "note"
    assert "have changed since this process began" in changed.what
    assert watch.turn(2 * DATES_EVERY_S, NOW_S) is None
    assert watch.turn(2 * DATES_EVERY_S + NOTE_EVERY_S, NOW_S).level == "note"
    robot.key.unlink()
    gone = watch.turn(3 * DATES_EVERY_S + NOTE_EVERY_S, NOW_S)
    assert (gone.level, "key.pem is not there" in gone.what) == ("wrong", True)
    assert WRONG_EVERY_S < NOTE_EVERY_S


class Links:
    """A link watch, whose reasons for a missing link are given, second by second."""

    def __init__(self, connect=(EDGE,)):
        self.asked = []
        self.watch = LinkWatch(connect, None, self.explain)
        self.at_s = 0.0

    def explain(self, endpoint, _certificates):
        self.asked.append(endpoint)
        return Finding("wrong", "our certificate is refused", "make it anew")

    def run(self, linked, seconds):
        lines = []
        for _ in range(seconds):
            self.at_s += 1.0
            lines += self.watch.turn(linked, self.at_s, NOW_S)
            self.wait_for_the_look()
        return lines

    def wait_for_the_look(self):
        deadline_s = time.monotonic() + 5
        while self.watch._is_looking() and time.monotonic() < deadline_s:
            time.sleep(0.001)


def test_a_link_that_comes_and_goes_is_said_when_it_changes():
    links = Links()
    assert links.run(True, 5) == [(logging.INFO, f"linked to {EDGE}")]
    assert links.run(False, int(EXPLAIN_AFTER_S) - 1) == [(logging.WARNING, f"no link yet to {EDGE}")]
    assert links.run(True, 5) == [(logging.INFO, f"linked to {EDGE}")]
    assert links.asked == []


def test_why_a_link_is_missing_for_long_is_looked_into_and_said():
    links = Links()
    lines = links.run(False, int(EXPLAIN_EVERY_S) * 2)
    reason = (logging.ERROR, "our certificate is refused; make it anew")
    assert lines == [(logging.WARNING, f"no link yet to {EDGE}"), reason, reason]
    assert links.asked == [EDGE] * 2


def test_a_router_that_links_to_nobody_misses_no_link():
    links = Links(connect=())
    assert links.run(False, 100) == []
    assert links.asked == []
