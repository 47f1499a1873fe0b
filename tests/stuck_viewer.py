"""A viewer that takes the first shot and never returns, until it is let go."""

import threading


class StuckSink:
    """Stands where Rerun would."""

    def __init__(self):
        self.entered = threading.Event()
        self.let_go = threading.Event()
        self.drawn = 0

    def lay_out(self, layout):
        self.layout = layout

    def draw(self, _shot):
        self.entered.set()
        self.let_go.wait(30)
        self.drawn += 1
        return True
