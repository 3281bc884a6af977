"""Ctrl-C and termination as a wish, asked for between steps, so that nothing is cut in half."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_THREAD = threading.local()


class Wish:
    """Whether somebody asked the run to stop."""

    def __init__(self) -> None:
        self.stop = False


def ask_to_stop() -> None:
    """Ask the run that this thread is in to stop between steps; for what watches the run."""
    wish: Wish | None = getattr(_THREAD, "wish", None)
    if wish is not None:
        wish.stop = True


@contextmanager
def stop_on_signal() -> Iterator[Wish]:
    """Turn SIGINT and SIGTERM into a wish while the block runs; a second SIGINT interrupts.

    Outside the main thread, where handlers cannot be set, signals keep their meaning.
    """
    wish, outer = Wish(), getattr(_THREAD, "wish", None)
    _THREAD.wish = wish
    try:
        with _on_signal(wish):
            yield wish
    finally:
        _THREAD.wish = outer


@contextmanager
def _on_signal(wish: Wish) -> Iterator[None]:
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def handle(number: int, frame: FrameType | None) -> None:  # noqa: ARG001
        if wish.stop and number == signal.SIGINT:
            raise KeyboardInterrupt
        wish.stop = True

    before = {s: signal.signal(s, handle) for s in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
