"""A progress bar for a terminal: simulated time, step size, length error and time left."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import IO

from stokesfibers.run.advance import Moment, Watch

_FORMAT = "{desc} |{bar}| {percentage:3.0f} %{postfix}, {remaining} left"


@contextmanager
def progress(
    until: float, *, start: float = 0.0, stream: IO[str] | None = None
) -> Iterator[Watch | None]:
    """Show a bar while the block runs and give the function that moves it.

    Parameters
    ----------
    until
        Simulated time at the end.
    start
        Simulated time at the start; 0 unless resumed.
    stream
        Where to draw; standard error by default. Unless it is a terminal nothing is drawn and
        None is given.
    """
    out = sys.stderr if stream is None else stream
    if not out.isatty():
        yield None
        return
    from tqdm import tqdm  # not needed by runs that nobody watches

    with tqdm(
        total=until,
        initial=start,
        file=out,
        bar_format=_FORMAT,
        dynamic_ncols=True,
        mininterval=0.1,
        leave=False,
    ) as bar:

        def show(moment: Moment) -> None:
            # Before `update`, which draws only now and then.
            bar.set_description_str(f"t = {moment.time:.4g} of {moment.until:g}", refresh=False)
            numbers = f"dt {moment.step_size:.3g}, length error {moment.length_error:.1e}"
            bar.set_postfix_str(numbers, refresh=False)
            bar.update(min(moment.time, moment.until) - bar.n)

        yield show
