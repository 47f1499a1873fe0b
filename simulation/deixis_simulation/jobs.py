"""Renders many scenes, one process a clip, some at a time. What is finished already is not rendered again.

A process a clip costs a second and leaves nothing behind: a worker that dies takes one clip with it, and that one is known.
"""

from __future__ import annotations

import multiprocessing
import os
import shutil
import signal
import tempfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from pathlib import Path

from deixis_runtime.interrupts import POLL_S, Interrupts

from .clip_files import is_finished
from .scene import Scene

Answer = tuple[str, str]
"""("frame", ""), ("done", "") or ("failed", why)."""


@dataclass
class Outcome:
    """Names of the clips that were there, that were rendered, and why others were not."""

    skipped: list[str] = field(default_factory=list)
    rendered: list[str] = field(default_factory=list)
    failed: dict[str, str] = field(default_factory=dict)
    left: list[str] = field(default_factory=list)


@dataclass
class Progress:
    """Who is told while it goes on: of frames that are done, of clips that are, were there already, or failed."""

    frame: Callable[[Scene], None] = lambda _: None
    ends: Callable[[Scene], None] = lambda _: None
    skips: Callable[[Scene], None] = lambda _: None
    fails: Callable[[Scene, str], None] = lambda _, __: None


@dataclass
class _Worker:
    process: SpawnProcess
    answers: Connection
    scene: Scene
    workplace: Path


class Interrupted(Exception):
    """SIGINT or SIGTERM came; `outcome` says what is finished."""

    def __init__(self, outcome: Outcome) -> None:
        super().__init__("stopped before the end")
        self.outcome = outcome


def render_all(
    scenes: Sequence[Scene], folder: Path, *, jobs: int | None = None, labels: bool = False, progress: Progress | None = None
) -> Outcome:
    """Render scenes into a folder, in this order, `jobs` at a time (as many as there are processors).

    Raises Interrupted on Ctrl-C and SIGTERM; clips that were finished then stay. OSError where the folder cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    run = _Run(folder, max(1, jobs or os.cpu_count() or 1), labels, progress or Progress())
    return run.all(scenes)


class _Run:
    def __init__(self, folder: Path, jobs: int, labels: bool, progress: Progress) -> None:
        self._folder, self._jobs, self._labels, self._progress = folder, jobs, labels, progress
        self._outcome = Outcome()
        self._workers: list[_Worker] = []
        self._context = multiprocessing.get_context("spawn")

    def all(self, scenes: Sequence[Scene]) -> Outcome:
        # Until the last worker's folder is gone: a signal that tore this apart would leave some behind.
        with Interrupts() as interrupts:
            try:
                self._work_off([scene for scene in scenes if not self._skipped(scene)][::-1], interrupts)
            finally:
                self._stop()
        return self._outcome

    def _work_off(self, waiting: list[Scene], interrupts: Interrupts) -> None:
        """Render scenes, the last of the list first. Raises Interrupted."""
        while waiting or self._workers:
            if interrupts.requested():
                self._outcome.left = [worker.scene.name for worker in self._workers] + [scene.name for scene in waiting[::-1]]
                raise Interrupted(self._outcome)
            while waiting and len(self._workers) < self._jobs:
                self._start(waiting.pop())
            self._listen()

    def _skipped(self, scene: Scene) -> bool:
        skipped = is_finished(scene, self._folder, labels=self._labels)
        if skipped:
            self._outcome.skipped.append(scene.name)
            self._progress.skips(scene)
        return skipped

    def _start(self, scene: Scene) -> None:
        workplace = Path(tempfile.mkdtemp(prefix=".unfinished-", dir=self._folder))
        answers, theirs = self._context.Pipe(duplex=False)
        process = self._context.Process(target=_work, args=(scene, self._folder, workplace, self._labels, theirs), daemon=True)
        process.start()
        theirs.close()
        self._workers.append(_Worker(process, answers, scene, workplace))

    def _listen(self) -> None:
        for connection in wait([worker.answers for worker in self._workers], POLL_S):
            worker = next(worker for worker in self._workers if worker.answers is connection)
            try:
                answer: Answer = worker.answers.recv()
            except EOFError:
                worker.process.join()
                answer = ("failed", f"its process died ({_say_exit(worker.process.exitcode)})")
            self._take(worker, answer)

    def _take(self, worker: _Worker, answer: Answer) -> None:
        what, why = answer
        if what == "frame":
            self._progress.frame(worker.scene)
            return
        if what == "done":
            self._outcome.rendered.append(worker.scene.name)
            self._progress.ends(worker.scene)
        else:
            self._outcome.failed[worker.scene.name] = why
            self._progress.fails(worker.scene, why)
        self._workers.remove(worker)
        _dismiss(worker)

    def _stop(self) -> None:
        for worker in self._workers:
            worker.process.terminate()
        for worker in self._workers:
            _dismiss(worker)
        self._workers = []


def _dismiss(worker: _Worker) -> None:
    worker.process.join(timeout=10)
    if worker.process.is_alive():
        worker.process.kill()
        worker.process.join()
    worker.answers.close()
    shutil.rmtree(worker.workplace, ignore_errors=True)


def _work(scene: Scene, folder: Path, workplace: Path, labels: bool, answers: Connection) -> None:
    """One clip, in a process of its own. Ctrl-C is the parent's to answer; without a parent the pipe breaks, and this ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.environ["LP_NUM_THREADS"] = "1"  # Mesa's: one clip a processor is quicker than all processors on one clip
    with suppress(BrokenPipeError):
        try:
            from .clip import render_clip  # noqa: PLC0415 - OpenGL is loaded where it is used, after the setting above

            render_clip(scene, folder, workplace, labels=labels, on_frame=lambda: answers.send(("frame", "")))
        except BrokenPipeError:
            raise
        except Exception as error:  # whatever it is belongs to this clip alone
            answers.send(("failed", str(error) or repr(error)))
        else:
            answers.send(("done", ""))


def _say_exit(code: int | None) -> str:
    if code is None or code >= 0:
        return f"exit status {code}"
    with suppress(ValueError):
        return signal.Signals(-code).name
    return f"signal {-code}"
