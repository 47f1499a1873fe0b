"""`deixis run --view FILE.rrd`: draws a run into a file while it goes on."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import zenoh
from deixis_cli.gets import get_raw
from deixis_schemas import topics

from .drawer import Drawer, Painter
from .feed import Feed
from .hearing import hear, keys_of
from .installed import SinkError, sink_for_file
from .options import DrawOptions, known_place, scene_of

if TYPE_CHECKING:
    from .rerun_sink import RerunSink

log = logging.getLogger("deixis-view")

END_S = 20.0


def file_view(path: Path, site: Path | None, robot: str) -> Callable[[zenoh.Session], AbstractContextManager[object]]:
    """What `deixis run` enters with its session to have itself drawn into the file. Raises CommandError, here already."""
    known = known_place(site)
    sink = sink_for_file(path, name=path.stem)

    @contextmanager
    def on(session: zenoh.Session) -> Iterator[None]:
        feed = Feed()
        painter = Painter(scene_of(known, DrawOptions(), live=False), sink)
        for poi in get_raw(session, topics.POI.key(robot, id="*")):
            feed.put(poi)
        drawer = Drawer(feed, painter, END_S)
        try:
            with drawer, hear(session, keys_of(robot, pictures=True), feed):
                yield
        finally:
            _keep(sink, path)
        if not drawer.done:
            log.warning("'%s' lacks the end: it could not be drawn within %.0f s", path, END_S)
        if feed.left_out:
            log.warning("'%s' lacks %d messages: this machine is too busy to draw all of them", path, feed.left_out)

    return on


def _keep(sink: RerunSink, path: Path) -> None:
    """Give the file its name, also after a run that failed: what was seen until then may say why."""
    try:
        whole = sink.close()
    except SinkError as error:
        log.warning("what was drawn is lost: %s", error)
        return
    if not whole:
        log.warning("'%s' could not be written to its end; what was there before stays", path)
