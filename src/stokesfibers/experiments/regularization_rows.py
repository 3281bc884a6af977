"""The numbers of `regularization`: eigenvalues, slopes, differences of trajectories."""

from __future__ import annotations

from collections.abc import Sequence
from math import log

import numpy as np
import xarray as xr

from stokesfibers.core.arrays import Array
from stokesfibers.experiments.base import Row

BOUND = log(4.0) - 1.0
"""log(m^2 / e) = log(2 m / e) for m = 2: the infimum of -(c + phi), inside and at the ends."""
_SLACK = 0.02
_CALLED = {"spheroidal": "spheroidal", "paper": "(16)", "constant": "constant"}
_SLOPES = {"spheroidal": (1.75, 2.0), "paper": (1.75, 2.0), "constant": (0.9, 1.1)}
_FINE = 1e-3
_LAW = 0.03


def rows(data: xr.Dataset) -> Sequence[Row]:
    """Return all rows."""
    found: list[Row] = []
    for kind in data["choice"].to_numpy():
        found += _of_eigenvalues(data.sel(choice=kind), str(kind))
    for kind in data["choice"].to_numpy():
        found += _of_changes(data.sel(choice=kind), str(kind))
    return [*found, *_closer(data), *_of_trajectories(data)]


def _of_eigenvalues(data: xr.Dataset, kind: str) -> list[Row]:
    """Return the least of all nodes, by eps; for (16) also where the sign is lost."""
    found = []
    for eps in data["eps"].to_numpy():
        for name, size in (("legendre", "nodes"), ("uniform", "intervals")):
            values, sizes = data[name].sel(eps=eps).to_numpy(), data[size].to_numpy()
            each = ", ".join(f"{v:.2f}" for v in values)
            where = f"{'Gauss-Legendre nodes' if size == 'nodes' else 'equal intervals'}"
            note = f"{size} {', '.join(str(n) for n in sizes)}: {each}."
            lost = kind == "paper"
            resolved = sizes[-1] * eps > (0.5 if size == "nodes" else 0.75)
            found.append(
                Row(
                    f"least eigenvalue, {_CALLED[kind]}, {where}, eps = {eps:.3g}",
                    float(values.min()),
                    low=None if lost else BOUND - _SLACK,
                    high=0.0 if lost and resolved else None,
                    note=note,
                )
            )
    return found


def _of_changes(data: xr.Dataset, kind: str) -> list[Row]:
    """Return the slope for thin fibers, and how well the law eps^2 (a log(1/eps) + b) holds."""
    eps, change = data["changed_at"].to_numpy(), data["change"].to_numpy()
    thin = eps <= _FINE * (1.0 + 1e-9)
    slope = float(np.polyfit(np.log(eps[thin]), np.log(change[thin]), 1)[0])
    found = [
        Row(
            f"slope of the change of the operator against eps, {_CALLED[kind]}",
            slope,
            None,
            *_SLOPES[kind],
            note=f"eps = {', '.join(f'{e:.1e}' for e in eps)}: "
            f"{', '.join(f'{c:.1e}' for c in change)}.",
        )
    ]
    if kind != "constant":
        quantity = f"largest deviation from eps^2 (a log(1/eps) + b), eps <= 0.01, {_CALLED[kind]}"
        found.append(Row(quantity, _misfit(eps[eps <= 0.011], change[eps <= 0.011]), high=_LAW))
    return found


def _misfit(eps: Array, change: Array) -> float:
    """Return the largest relative deviation from the best eps^2 (a log(1/eps) + b)."""
    scaled = change / eps**2
    fit = np.polyval(np.polyfit(-np.log(eps), scaled, 1), -np.log(eps))
    return float(np.abs(fit / scaled - 1.0).max())


def _closer(data: xr.Dataset) -> list[Row]:
    by = {str(kind): data["change"].sel(choice=kind).to_numpy() for kind in data["choice"].values}
    return [
        Row(
            f"largest change, spheroidal over {_CALLED[other]}, of all eps",
            float((by["spheroidal"] / by[other]).max()),
            high=1.0,
        )
        for other in ("paper", "constant")
    ]


def _of_trajectories(data: xr.Dataset) -> list[Row]:
    integral = dict(zip(data["choice"].to_numpy(), data["integral"].to_numpy(), strict=True))
    apart = dict(zip(data["choice"].to_numpy(), data["shape_difference"].to_numpy(), strict=True))
    quick = bool(data.attrs["quick"])
    limits = {"paper": (1e-5, 1e-4), "constant": (5e-5, 1e-4)}
    found = []
    for other, (shape, stress) in limits.items():
        name = f"{_CALLED[other]} against spheroidal, mu_bar = {data.attrs['mu_bar']:.0e}"
        relative = abs(integral[other] / integral["spheroidal"] - 1.0)
        high = (None, None) if quick else (shape, stress)
        found.append(Row(f"largest distance of shapes, {name}", apart[other], high=high[0]))
        found.append(
            Row(
                f"relative difference of the integral of N1, {name}",
                relative,
                high=high[1],
                note=f"{integral[other]:.6g} and {integral['spheroidal']:.6g}.",
            )
        )
    return found
