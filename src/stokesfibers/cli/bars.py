"""Progress: bars for commands that go through a run record by record, and for long calculations;
a word for what takes long without a number to show.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Timer
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from stokesfibers.experiments.base import Progress

Moved = Callable[[int, int], None]
PATIENCE_SECONDS = 2.0
"""After which a command that shows nothing says what it does."""


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


@contextmanager
def patience(what: str, *, quiet: bool = False) -> Iterator[None]:
    """Say `what` is done to standard error, if the block takes long."""
    if quiet:
        yield
        return
    timer = Timer(PATIENCE_SECONDS, click.echo, (f"{what} ...",), {"err": True})
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


@contextmanager
def share_bar(name: str = "") -> Iterator[Progress | None]:
    """Give the function that shows what is being computed and the share done; None unseen.

    Where nobody watches, one line says what has begun.
    """
    if not sys.stderr.isatty():
        if name:
            click.echo(f"computing {name}", err=True)
        yield None
        return
    from tqdm import tqdm

    form = "{desc} |{bar}| {percentage:3.0f} %, {elapsed}, {remaining} left"
    with tqdm(total=1.0, desc=name, leave=False, bar_format=form, dynamic_ncols=True) as shown:

        def show(what: str, share: float) -> None:
            shown.set_description_str(f"{name}: {what}" if name else what, refresh=False)
            shown.update(max(0.0, min(share, 1.0) - shown.n))

        yield show
