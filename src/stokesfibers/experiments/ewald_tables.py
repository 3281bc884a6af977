"""Measured errors of the Ewald sum against slow sums, for all domains, tolerances and both splits.

The cloud is random, its forces add up to zero; errors are relative, rms over a part of the points,
against the sums of `slow_sums`. The cut-off is the one the sum chooses, unless said.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from stokesfibers.core.arrays import Array
from stokesfibers.core.parallel import Workers
from stokesfibers.domain import AbstractDomain, Free, Periodic
from stokesfibers.domain.sheared import Sheared
from stokesfibers.experiments import ewald_tables_rows, slow_sums
from stokesfibers.experiments.base import Settings
from stokesfibers.experiments.slow_sums import Pairs
from stokesfibers.summation.ewald import EwaldSum
from stokesfibers.summation.ewald.accuracy import bandwidth_for, estimated_error

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

check = ewald_tables_rows.rows
SIDE = 1.0
SEED = 11
SPLITS = ("prolate", "gaussian")
TURNS = (1, 3)
"""In the sheared cell: images one period up in y are a third of a period along x."""
CUTOFFS = (0.15, 0.2, 0.25, 0.3, 0.4, 0.5)
"""Over the period; all that a sum with one tolerance is tried with."""
CUTOFF_TOLERANCE = 1e-8
ESTIMATED_AT = 0.2
"""Cut-off at which the estimate is compared; the transforms are then ten times finer."""
_FINER = 0.1
LEAST_ESTIMATED = 1e-9
"""Below it the Gaussian's near polynomials cannot be ten times finer."""
_CUBE = (SIDE, SIDE, SIDE)
LATTICES = {
    "simple cubic": ((0.0, 0.0, 0.0),),
    "body-centred": ((0.0, 0.0, 0.0), (0.5, 0.5, 0.5)),
    "face-centred": ((0.0, 0.0, 0.0), (0.0, 0.5, 0.5), (0.5, 0.0, 0.5), (0.5, 0.5, 0.0)),
}
"""Points in a cubic cell."""


@dataclass(frozen=True)
class Known:
    """A domain and the slow sum for it."""

    domain: AbstractDomain
    slow: Callable[[Pairs], Array]


DOMAINS = {
    "free": Known(Free(), slow_sums.free),
    "one": Known(Periodic((SIDE, 0.0, 0.0)), lambda p: slow_sums.one_direction(p, SIDE, 0)),
    "two": Known(Periodic((SIDE, SIDE, 0.0)), lambda p: slow_sums.two_directions(p, _CUBE[:2])),
    "three": Known(Periodic(_CUBE), lambda p: slow_sums.three_directions(p, _CUBE)),
    "sheared": Known(
        Sheared(_CUBE, TURNS[0] / TURNS[1]),
        lambda p: slow_sums.three_directions(*slow_sums.sheared_as_copies(p, _CUBE, TURNS)),
    ),
}
LABELS = {
    "free": "free",
    "one": "1 period",
    "two": "2 periods",
    "three": "3 periods",
    "sheared": "sheared",
}


def run(settings: Settings) -> xr.Dataset:
    """Return errors by domain, split and tolerance, by cut-off, and against the estimate."""
    exponents = (3, 6, 10) if settings.quick else range(3, 11)
    tolerances = [10.0**-e for e in exponents]
    points, targets = (400, 24) if settings.quick else (1000, 100)
    sources, forces = _cloud(points)
    pairs = Pairs(sources[:targets], sources, forces)
    workers = Workers(1)
    error = np.empty((len(DOMAINS), len(SPLITS), len(tolerances)))
    cutoff = np.empty(error.shape)
    by_cutoff = np.empty((len(DOMAINS), len(SPLITS), len(CUTOFFS)))
    alone, estimate = np.empty((2, len(SPLITS), len(tolerances)))
    for i, (name, known) in enumerate(DOMAINS.items()):
        if settings.progress:
            settings.progress(f"slow sum, {name}", i / len(DOMAINS))
        measured = _Measured(pairs, known, workers)
        for j, split in enumerate(SPLITS):
            for k, tolerance in enumerate(tolerances):
                error[i, j, k], cutoff[i, j, k], _ = measured(EwaldSum(tolerance, split))
            for k, rc in enumerate(CUTOFFS):
                by_cutoff[i, j, k] = measured(EwaldSum(CUTOFF_TOLERANCE, split, rc=rc * SIDE))[0]
        if name == "three":
            alone, estimate = _split_alone(measured, tolerances)
    axes = ("domain", "split")
    return xr.Dataset(
        {
            "error": ((*axes, "tolerance"), error),
            "rc": ((*axes, "tolerance"), cutoff),
            "error_by_cutoff": ((*axes, "cutoff"), by_cutoff),
            "split_error": (("split", "tolerance"), alone),
            "split_estimate": (("split", "tolerance"), estimate),
            "lattice_constant": (("lattice", "tolerance"), _constants(tolerances, workers)),
        },
        coords={
            "domain": list(DOMAINS),
            "split": list(SPLITS),
            "tolerance": tolerances,
            "cutoff": list(CUTOFFS),
            "lattice": list(LATTICES),
        },
        attrs={
            "points": points,
            "targets": targets,
            "cutoff_tolerance": CUTOFF_TOLERANCE,
            "quick": int(settings.quick),
        },
    )


def _cloud(points: int) -> tuple[Array, Array]:
    random = np.random.default_rng(SEED)
    sources, forces = SIDE * random.random((points, 3)), random.standard_normal((points, 3))
    return sources, forces - forces.mean(axis=0)


class _Measured:
    """Measures the relative error of Ewald sums of one cloud in one domain."""

    def __init__(self, pairs: Pairs, known: Known, workers: Workers) -> None:
        self._pairs, self._domain, self._workers = pairs, known.domain, workers
        self._exact = known.slow(pairs)
        self.points = len(pairs.sources)

    def __call__(self, ewald: EwaldSum) -> tuple[float, float, float]:
        """Return the error, the cut-off and the band-width."""
        plan = ewald.plan(self._domain, self._pairs.sources, workers=self._workers)
        found = plan.execute(self._pairs.forces)[: len(self._exact)]
        off = float(np.linalg.norm(found - self._exact) / np.linalg.norm(self._exact))
        assert plan.choice is not None
        return off, plan.choice.split.rc, plan.choice.split.bandwidth


def _split_alone(measured: _Measured, tolerances: Sequence[float]) -> tuple[Array, Array]:
    """Return what the splits leave out, measured and estimated, (split, tolerance).

    NaN below `LEAST_ESTIMATED`.
    """
    found, estimate = np.full((2, len(SPLITS), len(tolerances)), np.nan)
    for j, kind in enumerate(SPLITS):
        for k, tolerance in enumerate(tolerances):
            if tolerance < LEAST_ESTIMATED * (1.0 - 1e-9):
                continue
            width = bandwidth_for(kind, tolerance)
            ewald = EwaldSum(_FINER * tolerance, kind, rc=ESTIMATED_AT * SIDE, bandwidth=width)
            found[j, k] = measured(ewald)[0]
            density = measured.points * ESTIMATED_AT**3
            estimate[j, k] = estimated_error(kind, width, ESTIMATED_AT, density)
    return found, estimate


def _constants(tolerances: Sequence[float], workers: Workers) -> Array:
    """Return K of ``U = F (1 - K a / L) / (6 pi mu a)`` for spheres on lattices."""
    found = np.empty((len(LATTICES), len(tolerances)))
    for i, places in enumerate(LATTICES.values()):
        points = SIDE * (np.array(places) + 0.2)
        forces = np.tile([0.0, 0.0, 1.0], (len(points), 1))
        for k, tolerance in enumerate(tolerances):
            plan = EwaldSum(tolerance).plan(Periodic(_CUBE), points, workers=workers)
            found[i, k] = -0.75 * SIDE * plan.execute(forces)[0, 2]
    return found


def figure(data: xr.Dataset) -> Figure:
    """Draw errors against tolerances for both splits, errors by cut-off, and the estimate."""
    from stokesfibers.plot.style import PAGE, new_panels, style

    axes = new_panels(1, 4, width=PAGE, height=2.3)[0]
    with style():
        for ax, split in zip(axes, SPLITS, strict=False):
            _draw_errors(ax, data.sel(split=split))
            ax.set_title(split)
        _draw_cutoffs(axes[2], data)
        _draw_estimate(axes[3], data)
        drawn = axes[0].figure
        lines = axes[0].get_lines()[: len(DOMAINS)]
        drawn.legend(handles=lines, loc="outside upper center", ncols=len(DOMAINS))
    return drawn


def _draw_errors(ax: Axes, data: xr.Dataset) -> None:
    from stokesfibers.plot.style import FAINT, PALETTE

    tolerance = data["tolerance"].to_numpy()
    markers = "osD^v"
    for name, colour, marker in zip(DOMAINS, PALETTE, markers, strict=False):
        values = data["error"].sel(domain=name)
        ax.plot(
            tolerance, values, marker, linestyle="-", color=colour, markersize=2.5, linewidth=0.6,
            label=LABELS[name],
        )  # fmt: skip
    for share in (1.0, 0.01):
        ax.plot(tolerance, share * tolerance, color=FAINT, linewidth=0.6, linestyle="--")
    ax.set(xscale="log", yscale="log", xlabel="tolerance asked for", ylabel="error measured")
    ax.invert_xaxis()


def _draw_cutoffs(ax: Axes, data: xr.Dataset) -> None:
    from stokesfibers.plot.style import FAINT, PALETTE

    dashes: dict[str, Any] = {"prolate": "-", "gaussian": (0, (3, 1.5))}
    for name, colour in zip(DOMAINS, PALETTE, strict=False):
        for split, dash in dashes.items():
            values = data["error_by_cutoff"].sel(domain=name, split=split)
            ax.plot(data["cutoff"], values, color=colour, linestyle=dash, linewidth=0.7)
    ax.axhline(CUTOFF_TOLERANCE, color=FAINT, linewidth=0.6, linestyle="--")
    ax.set(yscale="log", xlabel="$r_c$ / period", title="dashed: gaussian")


def _draw_estimate(ax: Axes, data: xr.Dataset) -> None:
    from stokesfibers.plot.style import FAINT, INK

    for split, fill in zip(SPLITS, (INK, "white"), strict=True):
        ratio = data["split_error"].sel(split=split) / data["split_estimate"].sel(split=split)
        ax.plot(
            data["tolerance"], ratio, "o", color=INK, markerfacecolor=fill, markersize=3.0,
            label=split,
        )  # fmt: skip
    ax.axhline(1.0, color=FAINT, linewidth=0.6, linestyle="--")
    ax.set(xscale="log", ylim=(0.0, 2.0), xlabel="tolerance", ylabel="measured / estimated")
    ax.invert_xaxis()
    ax.legend(loc="upper left")
