"""A progress bar for commands that go through a run record by record."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

Moved = Callable[[int, int], None]


@contextmanager
def bar(what: str, *, quiet: bool) -> Iterator[Moved | None]:
    """Give the function that moves a bar of `what`; None if nobody watches."""
    if quiet or not sys.stderr.isatty():
        yield None
        return
    from tqdm import tqdm

    with tqdm(file=sys.stderr, unit=f" {what}", leave=False, mininterval=0.1) as shown:

        def moved(done: int, count: int) -> None:
            shown.total = count
            shown.update(done - shown.n)

        yield moved
