"""Errors name what the user typed: an option, not the argument of the function behind it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager


@contextmanager
def named_as_typed(options: Mapping[str, str]) -> Iterator[None]:
    """Let errors of the block name options.

    Parameters
    ----------
    options
        What the functions called say, and the option that it came from.
    """
    from stokesfibers.core.errors import InputError

    try:
        yield
    except InputError as error:
        if type(error) is not InputError or error.where not in options:
            raise
        typed = options[error.where]
        raise InputError(typed, error.expected, error.got, error.hint) from None
