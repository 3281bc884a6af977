"""Errors a user can meet. Each says what was expected, what came, where, and what to try."""

from __future__ import annotations


class StokesFibersError(Exception):
    """Base of all errors raised on purpose by this package."""


class InputError(StokesFibersError, ValueError):
    """Something given by the user cannot be used.

    Parameters
    ----------
    where
        Path of the offending item, e.g. ``"fiber.slenderness"`` or a file name.
    expected
        What would have been accepted.
    got
        What came instead; shown with ``repr`` unless it is a string.
    hint
        What to try, one sentence, or empty.
    """

    def __init__(self, where: str, expected: str, got: object, hint: str = "") -> None:
        self.where = where
        self.expected = expected
        self.got = got if isinstance(got, str) else repr(got)
        self.hint = hint
        super().__init__(self._message())

    def _message(self) -> str:
        text = f"{self.where}: expected {self.expected}, got {self.got}."
        return f"{text} {self.hint}" if self.hint else text

    def at(self, prefix: str) -> InputError:
        """Return the same error with `prefix` put before the path of the item."""
        return InputError(f"{prefix}.{self.where}", self.expected, self.got, self.hint)


class StoreError(InputError):
    """A run store is missing, foreign, damaged, in use, or would be overwritten."""


class MissingExtraError(StokesFibersError, ImportError):
    """An optional dependency is not installed; the message says how to get it."""

    def __init__(self, package: str, extra: str, purpose: str) -> None:
        super().__init__(
            f"{purpose} needs the package '{package}'. "
            f"Install it with: pip install 'stokesfibers[{extra}]'"
        )
