"""A backend of matplotlib whose windows nobody sees and nobody closes; it stands in for every interactive one.

Its event loop runs timers, such as those of animations, at their time. It paints nothing: a figure is drawn where it is
saved. Like the rest of this folder it works in a bare process as well.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any, ClassVar

from matplotlib._pylab_helpers import Gcf
from matplotlib.backend_bases import DrawEvent, FigureManagerBase, TimerBase
from matplotlib.backends.backend_agg import FigureCanvasAgg

#: How long a window sleeps at most before it looks again whether it is still open, in seconds.
NAP_S = 0.1


class Timer(TimerBase):
    """A timer of the event loop: its period begins when its callbacks have returned, as with Tk."""

    running: ClassVar[list[Timer]] = []
    # of matplotlib
    _interval: int
    _single: bool
    _on_timer: Any

    def _timer_start(self) -> None:
        self._timer_stop()
        self.due_s = time.monotonic() + self._interval / 1000
        self.running.append(self)

    def _timer_stop(self) -> None:
        if self in self.running:
            self.running.remove(self)

    def _timer_set_interval(self) -> None:
        if self in self.running:
            self._timer_start()

    def fire(self) -> None:
        """Run the callbacks."""
        if self._single:
            self._timer_stop()
        self._on_timer()
        if self in self.running:
            self.due_s = time.monotonic() + self._interval / 1000


class FigureCanvas(FigureCanvasAgg):
    """The canvas of a window."""

    _timer_cls = Timer
    _waits = False  # whether somebody has asked for it to be drawn
    _looping = False

    def draw_idle(self, *args: Any, **kwargs: Any) -> None:
        """Draw at the next turn of the event loop."""
        self._waits = True

    def flush_events(self) -> None:
        """Take a turn of the event loop."""
        _turn()

    def start_event_loop(self, timeout: float = 0) -> None:
        """Run the event loop for so many seconds, or until it is stopped if there is no limit."""
        self._looping = True
        end_s = time.monotonic() + timeout if timeout > 0 else math.inf
        _run(lambda: self._looping, end_s)
        self._looping = False

    def stop_event_loop(self) -> None:
        """End the event loop."""
        self._looping = False

    def pretend_to_draw(self) -> None:
        """Tell those who wait for it that the figure has been drawn."""
        if self._waits:
            self._waits = False
            drawn: Any = DrawEvent("draw_event", self, self.get_renderer())  # type: ignore[no-untyped-call]
            drawn._process()


class FigureManager(FigureManagerBase):
    """A window."""

    def show(self) -> None:
        """Open the window, which draws the figure."""
        self.canvas.draw_idle()

    @classmethod
    def start_main_loop(cls) -> None:
        """Run the event loop until all windows are closed."""
        _run(lambda: bool(Gcf.get_all_fig_managers()), math.inf)


_class: Any = FigureCanvas
_class.manager_class = FigureManager


def _run(goes_on: Callable[[], bool], end_s: float) -> None:
    while goes_on():
        _turn()
        now_s = time.monotonic()
        if now_s >= end_s or not goes_on():
            return
        next_s = min([timer.due_s for timer in Timer.running], default=math.inf)
        time.sleep(max(0.0, min(next_s, end_s, now_s + NAP_S) - now_s))


def _turn() -> None:
    """Draw what waits for it, and run the timers that are due."""
    managers: list[Any] = Gcf.get_all_fig_managers()
    for manager in managers:
        manager.canvas.pretend_to_draw()
    for timer in sorted(Timer.running, key=lambda one: one.due_s):
        if timer in Timer.running and timer.due_s <= time.monotonic():
            timer.fire()
