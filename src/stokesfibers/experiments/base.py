"""What an experiment is: a published figure that is computed, drawn and checked by one file."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Protocol, cast

from stokesfibers.core.version import __version__

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

Progress = Callable[[str, float], None]
"""Told now and then: what is being computed, and the share of it that is done, 0 to 1."""
Verdict = Literal["agrees", "differs", "known difference", "reported"]


@dataclass(frozen=True)
class Settings:
    """How to run an experiment.

    Attributes
    ----------
    folder
        Where results go; finished runs are kept in its folder ``runs`` and used again.
    quick
        Coarser and shorter runs by the same code, in seconds.
    seed
        For experiments that draw random numbers; the paper's single-fiber figures draw none.
    workers
        Processes that compute independent runs; 1 stays in this process.
    progress
        Called while runs are computed.
    """

    folder: Path
    quick: bool = False
    seed: int | None = None
    workers: int = 1
    progress: Progress | None = None


@dataclass(frozen=True)
class Row:
    """One number of the paper beside ours.

    Attributes
    ----------
    quantity
        What it is.
    ours
        Our value.
    paper
        The printed value or statement; None where the paper gives none.
    low, high
        Range, ends included, that `ours` has to lie in; None leaves that side open.
    note
        How it was measured, or what to know about it.
    known
        Why a value outside the range is understood and stands; empty if nothing is known.
    known_low, known_high
        Range that such a value has to lie in: what is known, not just that something is.

    Raises
    ------
    ValueError
        If a difference is known but not its range.
    """

    quantity: str
    ours: float
    paper: float | str | None = None
    low: float | None = None
    high: float | None = None
    note: str = ""
    known: str = ""
    known_low: float | None = None
    known_high: float | None = None

    def __post_init__(self) -> None:
        if self.known and self.known_low is None and self.known_high is None:
            raise ValueError(f"{self.quantity}: a known difference without its range")

    @property
    def verdict(self) -> Verdict:
        """Whether ours lies in the range; ``"reported"`` where there is none."""
        if self.low is None and self.high is None:
            return "reported"
        if _within(self.ours, self.low, self.high):
            return "agrees"
        known = self.known and _within(self.ours, self.known_low, self.known_high)
        return "known difference" if known else "differs"

    def to_dict(self) -> dict[str, Any]:
        """Return the row as JSON-ready values; a number that is not finite becomes None."""
        notes = [self.note, self.known if self.verdict == "known difference" else ""]
        return {
            "quantity": self.quantity,
            "paper": self.paper,
            "ours": float(self.ours) if isfinite(self.ours) else None,
            "range": [self.low, self.high],
            "verdict": self.verdict,
            "note": " ".join(n for n in notes if n),
        }


def _within(value: float, low: float | None, high: float | None) -> bool:
    above = low is None or value >= low
    return isfinite(value) and above and (high is None or value <= high)


class Parts(Protocol):
    """What the module of an experiment holds."""

    def run(self, settings: Settings) -> xr.Dataset:
        """Compute the figure's data, or take them from runs that are there."""
        ...

    def figure(self, data: xr.Dataset) -> Figure:
        """Draw the data."""
        ...

    def check(self, data: xr.Dataset) -> Sequence[Row]:
        """Compare the data with the paper."""
        ...


@dataclass(frozen=True)
class Experiment:
    """A figure of a paper, as something to run.

    Attributes
    ----------
    name
        Short name, e.g. ``"fig04"``.
    title
        One line for people.
    source
        Where in the paper.
    module
        Module with the functions ``run``, ``figure`` and ``check``; imported when first used.
    """

    name: str
    title: str
    source: str
    module: str = field(repr=False)

    def run(self, settings: Settings) -> xr.Dataset:
        """Return the figure's data."""
        return self._parts().run(settings)

    def figure(self, data: xr.Dataset) -> Figure:
        """Return the figure of `data`."""
        return self._parts().figure(data)

    def check(self, data: xr.Dataset) -> list[Row]:
        """Return the paper's numbers beside those of `data`."""
        return list(self._parts().check(data))

    def reproduce(
        self,
        out: str | Path,
        *,
        quick: bool = False,
        seed: int | None = None,
        workers: int = 1,
        progress: Progress | None = None,
    ) -> dict[str, Any]:
        """Run, draw and check; write ``<name>.png``, ``.pdf``, ``.nc`` and ``.json`` to `out`.

        Parameters
        ----------
        out
            Folder, made if missing. Files of an earlier reproduction are replaced.
        quick, seed, workers, progress
            See `Settings`.

        Returns
        -------
        dict
            What the JSON file holds: ``rows``, each with quantity, paper, ours, range, verdict
            and note; ``verdict``, ``"differs"`` if any row differs; ``files``.

        Raises
        ------
        KeyboardInterrupt
            If somebody asked a run to stop; calling again continues it.
        """
        folder = Path(out)
        folder.mkdir(parents=True, exist_ok=True)
        data = self.run(Settings(folder, quick, seed, workers, progress))
        rows = self.check(data)
        files = _write(self.name, folder, data, self.figure(data))
        summary = {
            "name": self.name,
            "title": self.title,
            "source": self.source,
            "version": __version__,
            "quick": quick,
            "seed": seed,
            "verdict": "differs" if any(r.verdict == "differs" for r in rows) else "agrees",
            "rows": [r.to_dict() for r in rows],
            "files": [*files, f"{self.name}.json"],
        }
        text = json.dumps(summary, indent=2, allow_nan=False)
        (folder / f"{self.name}.json").write_text(text + "\n", encoding="utf-8")
        return summary

    def _parts(self) -> Parts:
        return cast(Parts, import_module(self.module))


_DPI = 200  # enough for pages; there is a pdf too


def _write(name: str, folder: Path, data: xr.Dataset, drawn: Figure) -> list[str]:
    """Write figure and data; return the names of the files."""
    from stokesfibers.plot.style import save

    files = [f"{name}.png", f"{name}.pdf", f"{name}.nc"]
    for file in files[:2]:
        save(drawn, folder / file, _DPI)
    # NetCDF 3 needs no library beyond SciPy and opens everywhere, labels and units included.
    data.to_netcdf(folder / files[2], engine="scipy")
    return files
