"""What a validation is made of: an entry is a record with a function, a finding one number."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from math import isfinite
from typing import Literal

from stokesfibers.experiments.base import Row, Settings

Verdict = Literal["agrees", "differs", "explained"]
Tier = Literal["quick", "full"]
Group = Literal["exact", "independent", "orders", "published"]
GROUPS: dict[Group, str] = {
    "exact": "Exact answers",
    "independent": "Independent calculations and other authors' numbers",
    "orders": "Orders of convergence",
    "published": "Figures and numbers of the paper, and studies beside it",
}
"""Groups in the order of the tables, with their headings."""


@dataclass(frozen=True)
class Finding:
    """One number beside the one it is held against.

    Attributes
    ----------
    quantity
        What it is.
    ours
        Our value.
    theirs
        The exact, published or independent value, or what is stated in words; None for a bound
        that is ours alone.
    low, high
        Range, ends included, that `ours` has to lie in; None leaves that side open.
    erratum
        Where it is explained that `theirs`, as printed, is not what `ours` has to be. The range is
        then that of the right value.
    right
        What the range is about, where that is not `theirs`.
    """

    quantity: str
    ours: float
    theirs: float | str | None
    low: float | None
    high: float | None
    erratum: str = ""
    right: float | None = None

    def __post_init__(self) -> None:
        if self.low is None and self.high is None:
            raise ValueError(f"{self.quantity}: nothing it could differ from")

    @property
    def verdict(self) -> Verdict:
        """``"explained"`` where `theirs` is known to be wrong and ours is what it ought to be."""
        above = self.low is None or self.ours >= self.low
        below = self.high is None or self.ours <= self.high
        if isfinite(self.ours) and above and below:
            return "explained" if self.erratum else "agrees"
        return "differs"

    @property
    def error(self) -> float | None:
        """Distance to `theirs`, relative to it unless it is zero; None without a number."""
        if not isinstance(self.theirs, float | int):
            return None
        return abs(self.ours - self.theirs) / (abs(self.theirs) or 1.0)

    @property
    def tolerance(self) -> str:
        """What is allowed, in the units of `error` where the range is about `theirs`."""
        if self.low is None:
            return f"at most {self.high:.6g}"
        if self.high is None:
            return f"at least {self.low:.6g}"
        centre = self.theirs if self.right is None else self.right
        if isinstance(centre, float | int):
            below, above = centre - self.low, self.high - centre
            if above >= 0.0 and abs(above - below) <= 1e-6 * (above + below):
                allowed = f"{0.5 * (above + below) / (abs(centre) or 1.0):.2g}"
                return allowed if self.right is None else f"{allowed} of {centre:.6g}"
        return f"{self.low:.6g} to {self.high:.6g}"


@dataclass(frozen=True)
class Entry:
    """One validation: a name, where the numbers come from, and the function that computes ours.

    Attributes
    ----------
    name
        What ``--only`` takes.
    group
        Which table it is in.
    title
        One line for people.
    source
        Whose numbers they are held against.
    work
        Returns the findings; called with where to keep runs, the tier, and who is told how far.
    tier
        ``"quick"`` entries run always, ``"full"`` ones only in the full suite.
    """

    name: str
    group: Group
    title: str
    source: str
    work: Callable[[Settings], Iterable[Finding]]
    tier: Tier = "quick"


def close(
    quantity: str, ours: float, theirs: float, *, rtol: float = 0.0, atol: float = 0.0
) -> Finding:
    """Return a finding that may be off by ``atol + rtol |theirs|``, which must be above zero."""
    allowed = atol + rtol * abs(theirs)
    if not allowed > 0.0:
        raise ValueError(f"{quantity}: a tolerance above zero is needed")
    return Finding(quantity, float(ours), float(theirs), theirs - allowed, theirs + allowed)


def corrected(
    quantity: str, ours: float, printed: float, *, right: float, rtol: float, erratum: str
) -> Finding:
    """Return a finding that has to be `right`, within rtol, instead of what is `printed`."""
    allowed = rtol * abs(right)
    if abs(printed - right) <= allowed:
        raise ValueError(f"{quantity}: the printed value is as good as the right one")
    low, high = right - allowed, right + allowed
    return Finding(quantity, float(ours), float(printed), low, high, erratum, right=float(right))


def of_row(row: Row, erratum: str) -> Finding:
    """Return the finding of an experiment's row that has a range.

    Parameters
    ----------
    row
        Of an experiment's `check`.
    erratum
        Where differences that the row knows of are explained.
    """
    if row.verdict == "known difference":  # held against what is known
        low, high = row.known_low, row.known_high
        return Finding(row.quantity, row.ours, row.paper, low, high, erratum)
    return Finding(row.quantity, row.ours, row.paper, row.low, row.high)
