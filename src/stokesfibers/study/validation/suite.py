"""Run the suite: entry by entry, each on its own, so that one that fails stops no other."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any, Literal

from stokesfibers.core.errors import InputError, MissingExtraError
from stokesfibers.core.tables import did_you_mean
from stokesfibers.core.version import __version__
from stokesfibers.experiments.base import Settings
from stokesfibers.run.simulate import reproducible
from stokesfibers.study.validation.record import Entry, Finding

Outcome = Literal["agrees", "differs", "explained", "failed", "not run"]


@dataclass(frozen=True)
class Result:
    """What came of one entry.

    Attributes
    ----------
    entry
        The entry.
    findings
        Its numbers; none if it failed.
    problem
        Why there are none: a missing extra, or the last line of the error.
    details
        The whole traceback of an error.
    seconds
        Wall time.
    """

    entry: Entry
    findings: tuple[Finding, ...]
    problem: str = ""
    details: str = ""
    seconds: float = 0.0

    @property
    def outcome(self) -> Outcome:
        """The worst verdict; ``"not run"`` if an extra is missing, ``"failed"`` after an error."""
        if self.details:
            return "failed"
        if self.problem:
            return "not run"
        verdicts = {finding.verdict for finding in self.findings}
        return next(v for v in ("differs", "explained", "agrees") if v in verdicts)


@dataclass(frozen=True)
class Report:
    """What came of a run of the suite.

    Attributes
    ----------
    tier
        ``"quick"`` or ``"full"``.
    results
        Of each entry, in order.
    version
        Of this package.
    """

    tier: str
    results: tuple[Result, ...]
    version: str = __version__

    @property
    def bad(self) -> list[str]:
        """Names of entries that differ or failed."""
        return [r.entry.name for r in self.results if r.outcome in ("differs", "failed")]

    def counts(self) -> dict[str, int]:
        """Return how many numbers have each verdict, and how many entries gave none."""
        found: dict[str, int] = dict.fromkeys(("agrees", "explained", "differs"), 0)
        for result in self.results:
            for finding in result.findings:
                found[finding.verdict] += 1
        for outcome in ("failed", "not run"):
            found[outcome] = sum(r.outcome == outcome for r in self.results)
        return found


def chosen(entries: Iterable[Entry], names: Iterable[str], *, quick: bool) -> list[Entry]:
    """Return the entries of a tier, or those named, whatever their tier.

    Raises
    ------
    InputError
        If a name is not known.
    """
    known = {entry.name: entry for entry in entries}
    wanted = list(names)
    for name in wanted:
        if name not in known:
            expected = f"one of {', '.join(known)}"
            raise InputError("--only", expected, repr(name), did_you_mean(name, known))
    if wanted:
        return [known[name] for name in dict.fromkeys(wanted)]
    return [entry for entry in known.values() if entry.tier == "quick" or not quick]


def validate(
    entries: Iterable[Entry],
    settings: Settings,
    tell: Callable[[Result], Any] = lambda _: None,
) -> Report:
    """Run `entries` one after another.

    Parameters
    ----------
    entries
        What to run.
    settings
        Where runs are kept, the tier, workers, and who is told how far things are: the progress
        is that of all entries together.
    tell
        Called with each result as it comes.

    Raises
    ------
    KeyboardInterrupt
        If somebody asked to stop; what `tell` was told stands.
    """
    todo, results = list(entries), []
    for number, entry in enumerate(todo):
        result = _of(entry, _share_of(settings, entry, number, len(todo)))
        results.append(result)
        tell(result)
    return Report("quick" if settings.quick else "full", tuple(results))


def _of(entry: Entry, settings: Settings) -> Result:
    start = perf_counter()
    try:
        with reproducible():
            findings = tuple(entry.work(settings))
        if not findings:
            raise ValueError(f"{entry.name} found nothing to compare")
    except MissingExtraError as error:
        return Result(entry, (), str(error), seconds=perf_counter() - start)
    except Exception as error:  # one entry must not stop the others, whatever happens in it
        last = traceback.format_exception_only(error)[-1].strip()
        whole = "".join(traceback.format_exception(error))
        return Result(entry, (), last, whole, perf_counter() - start)
    return Result(entry, findings, seconds=perf_counter() - start)


def _share_of(settings: Settings, entry: Entry, number: int, count: int) -> Settings:
    """Return the settings for one entry: its progress is a part of the whole."""
    outer = settings.progress
    if outer is None:
        return settings
    outer(entry.name, number / count)

    def progress(what: str, share: float) -> None:
        outer(f"{entry.name}: {what}", (number + share) / count)

    return replace(settings, progress=progress)
