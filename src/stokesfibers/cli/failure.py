"""How commands end: exit codes, and one clear message for everything that can go wrong."""

from __future__ import annotations

import functools
import sys
import tempfile
import traceback
from collections.abc import Callable
from typing import IO, Any, ParamSpec

import click

from stokesfibers.core.errors import StokesFibersError

DONE, OUR_FAULT, BAD_INPUT, RUN_FAILED, INTERRUPTED = 0, 1, 2, 3, 130

P = ParamSpec("P")


class Refused(click.ClickException):
    """An error of the input that is found before the command begins; told as all others are."""

    exit_code = BAD_INPUT

    def __init__(self, error: StokesFibersError) -> None:
        super().__init__(str(error))

    def show(self, file: IO[Any] | None = None) -> None:  # noqa: ARG002
        """Print the message."""
        complain(self.message)


def guarded(work: Callable[P, int | None]) -> Callable[P, None]:
    """Return the command `work`, which returns its exit code, with every error reported.

    Codes: 0 done, 1 our fault, 2 the input, 3 the run failed and kept what it had, 130 interrupted.
    """

    @functools.wraps(work)
    def command(*args: P.args, **kwargs: P.kwargs) -> None:
        raise click.exceptions.Exit(reported(lambda: work(*args, **kwargs)))

    return command


def complain(message: str) -> None:
    """Print one error message to standard error."""
    click.secho("error: ", fg="red", bold=True, nl=False, err=True)
    click.echo(message, err=True)


def reported(work: Callable[[], int | None]) -> int:
    """Return the exit code of `work`, with every error reported."""
    try:
        return work() or DONE
    except (click.ClickException, click.exceptions.Exit, BrokenPipeError):
        raise  # click knows what to do
    except StokesFibersError as error:
        complain(str(error))
        return BAD_INPUT
    except OSError as error:
        place = f"{error.filename}: " if error.filename else ""
        complain(f"{place}{error.strerror or error}")
        return BAD_INPUT
    except MemoryError:
        complain("Not enough memory for this case. Take fewer discretization.intervals.")
        return BAD_INPUT
    except KeyboardInterrupt:
        complain(f"Interrupted.{_how_to_go_on()}")
        return INTERRUPTED
    except Exception as error:
        _report(error)
        return OUR_FAULT


def _how_to_go_on() -> str:
    """Return what may be done about a command that was interrupted before it could say so."""
    context = click.get_current_context(silent=True)
    if context is None or context.info_name not in ("run", "resume"):
        return ""
    return " If the run had begun, 'stokesfibers resume' goes on with it."


def _report(error: Exception) -> None:
    """Say that this is our fault and leave the details in a file."""
    from stokesfibers.io.provenance import provenance

    text = "".join(traceback.format_exception(error))
    what = traceback.format_exception_only(error)[-1].strip()
    try:
        with tempfile.NamedTemporaryFile(
            "w", prefix="stokesfibers-report-", suffix=".txt", delete=False, encoding="utf-8"
        ) as file:
            file.write(f"command: {' '.join(sys.argv)}\n{provenance()}\n\n{text}")
    except OSError:
        complain(f"This is a fault of stokesfibers, please report it: {what}\n{text}")
        return
    complain(
        f"This is a fault of stokesfibers: {what}\nPlease report it, with the file {file.name}"
    )
