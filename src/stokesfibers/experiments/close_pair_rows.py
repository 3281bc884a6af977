"""What the experiment on close filaments states: errors, orders, iterations, and their ranges."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import xarray as xr

from stokesfibers.core.arrays import Array
from stokesfibers.experiments import close_pair_tensions as tensions
from stokesfibers.experiments import close_pair_velocity as velocity
from stokesfibers.experiments.base import Row
from stokesfibers.experiments.close_pair_velocity import blend_distance

LIMIT = 3.0
"""Distance over d_0 down to which errors are stated."""
FAR = 0.48
"""A distance at which nothing is refined at any level: 12 h = 0.24 at N = 50."""
NEAR = 0.06
"""3 d_0 at N = 50."""
_WITHIN = 5e-3
"""What the refinement, whose error hardly falls with h, has to keep at all levels."""
_BY_DIFFERENCES = "x_s and x_sss by differences"


def errors(
    data: xr.Dataset, rule: str, eps: float, intervals: int, *, nodal: str = "exact"
) -> Array:
    """Return the errors of a rule by distance."""
    picked = data["error"].sel(rule=rule, nodal=nodal, eps=eps, intervals=intervals)
    return picked.to_numpy()


def counts(data: xr.Dataset, case: str, solver: str) -> Array:
    """Return the iterations from zero tensions by distance over d_0."""
    return data["iterations"].sel(case=case, solver=solver, start="zero").to_numpy()


def velocity_rows(data: xr.Dataset) -> list[Row]:
    """Return the largest errors, orders in h, and where refinement helps and where it harms."""
    levels = data["intervals"].to_numpy()
    rows = []
    for eps in velocity.EPSILONS:
        for n in levels:
            rows += _stated(data, eps, int(n))
    rows += _orders(data)
    for n in levels:
        rows += _crossover(data, int(n))
    blended = data["error"].sel(rule="default") - data["error"].sel(rule="refined")
    return [
        *rows,
        Row(
            "change of the error by the blend, largest, from 2 d_0 on",
            float(abs(blended).max()),
            high=0.0,
        ),
        Row(
            "relative error of the reference",
            float(data["reference_error"].max()),
            high=1e-10,
            note="The adaptive quadrature's own estimate.",
        ),
    ]


def _stated(data: xr.Dataset, eps: float, n: int) -> list[Row]:
    """Return the largest errors from 1 L to 3 d_0, and those at 3 d_0."""
    rows = []
    distance = data["distance"].to_numpy()
    limit = LIMIT * blend_distance(eps, n)
    seen, at_limit = distance > 0.999 * limit, int(np.argmin(np.abs(distance - limit)))
    second_order = 1.5 / n**2
    for rule, high in (("plain", second_order), ("refined", _WITHIN)):
        error = errors(data, rule, eps, n)
        which = f"{rule} rule, eps = {eps:g}, N = {n}"
        largest = float(error[seen].max())
        rows += [
            Row(f"largest error, 1 L to 3 d_0, {which}", largest, high=high),
            Row(f"error at 3 d_0, {which}", float(error[at_limit]), high=high),
        ]
    error = errors(data, "all_refined", eps, n)
    quantity = f"error at 3 d_0, all intervals cut, eps = {eps:g}, N = {n}"
    note = "x_s and F are linear within an interval."
    rows.append(Row(quantity, float(error[at_limit]), high=12.0 / n**2, note=note))
    for rule, extra in (("plain", 0.0), ("default", _WITHIN)):
        error = errors(data, rule, eps, n, nodal="differences")
        name = {"plain": "plain rule", "default": "refined rule"}[rule]
        quantity = f"largest error, {_BY_DIFFERENCES}, 1 L to 3 d_0, {name}, eps = {eps:g}, N = {n}"
        rows.append(Row(quantity, float(error[seen].max()), high=40.0 / n**2 + extra))
    return rows


def _orders(data: xr.Dataset) -> list[Row]:
    """Return the orders in h between consecutive levels at fixed distances, eps = 1e-2."""
    said = "second-order method"
    cut_ends = "Where the cut intervals end, at 12 h, h^2/12 g' remains, with g ~ R^-2: not small."
    # rule, name, nodal values, distance, range
    asked = (
        ("plain", "plain rule", "exact", FAR, (1.9, 2.1)),
        ("plain", "plain rule", "exact", NEAR, (1.9, 2.1)),
        ("default", "refined rule", "exact", FAR, (1.9, 2.1)),
        ("all_refined", "all intervals cut", "exact", NEAR, (1.9, 2.1)),
        ("default", "refined rule", "differences", FAR, (1.9, 2.2)),
        ("plain", "plain rule", "differences", NEAR, (1.9, 2.2)),
    )
    rows = []
    levels = [int(n) for n in data["intervals"].to_numpy()]
    for coarse, fine in pairwise(levels):
        for rule, name, nodal, distance, (low, high) in asked:
            order = _order(data.sel(rule=rule, nodal=nodal), distance, coarse, fine)
            values = "" if nodal == "exact" else f"{_BY_DIFFERENCES}, "
            quantity = f"order, {values}{name}, distance {distance:g}, N = {coarse}, {fine}"
            rows.append(Row(quantity, order, said, low, high))
    order = _order(data.sel(rule="refined", nodal="exact"), NEAR, levels[0], levels[1])
    quantity = f"order, refined rule, distance {NEAR:g}, N = {levels[0]}, {levels[1]}"
    return [*rows, Row(quantity, order, high=1.0, note=cut_ends)]


def _order(data: xr.Dataset, distance: float, coarse: int, fine: int) -> float:
    """Return the order of one rule between two levels."""
    at = data["error"].sel(eps=velocity.EPSILONS[0]).sel(distance=distance, method="nearest")
    ratio = at.sel(intervals=coarse) / at.sel(intervals=fine)
    return float(np.log(ratio) / np.log(fine / coarse))


def _crossover(data: xr.Dataset, n: int) -> list[Row]:
    """Return what refinement gains closest by, where it ends to help, and what it costs beyond."""
    eps = velocity.EPSILONS[1]  # d_0 = h: the closest approach in units of h
    spacings = data["distance"].to_numpy() * n
    gain = errors(data, "plain", eps, n) / errors(data, "refined", eps, n)
    better = np.flatnonzero(gain > 1.0)
    where = f"eps = {eps:g}, N = {n}"
    return [
        Row(
            f"error of the plain rule over the refined one, distance {spacings[better[0]]:.2f} h, "
            f"{where}",
            float(gain[better[0]]),
            "refinement yields a better approximation",
            low=20.0,
        ),
        Row(
            f"distance/h from which the plain rule is at least as good, {where}",
            float(spacings[better[-1] + 1]),
            low=1.5,
            high=3.0,
        ),
        Row(
            f"error of the refined rule over the plain one beyond, largest, {where}",
            float(np.nanmax(1.0 / gain)),
            low=5.0,
        ),
    ]


def tension_rows(data: xr.Dataset) -> list[Row]:
    """Return the iterations at some distances, where a solver gave up, and the tensions' errors."""
    ratio = data["ratio"].to_numpy()
    rows = []
    for case in data["case"].to_numpy():
        for solver in tensions.SOLVERS:
            found = counts(data, case, solver)
            for at in (ratio[-1], 10.0, 3.0, 2.0, 1.0, 0.5):
                count = float(found[int(np.argmin(np.abs(ratio - at)))])
                high = 15.0 if at >= 2.0 else None
                note = "" if np.isfinite(count) else "Gave up."
                rows.append(
                    Row(f"{solver}, {case}, distance {at:g} d_0", count, high=high, note=note)
                )
    return [*rows, *_reliability(data)]


def _reliability(data: xr.Dataset) -> list[Row]:
    gave_up = data["iterations"].isnull()
    lost = float(data["ratio"].where(gave_up.sel(solver="sweeps").any(("case", "start"))).max())
    rows = [
        Row("largest distance/d_0 at which the sweeps gave up", lost, high=1.99),
        Row("times that gmres gave up", float(gave_up.sel(solver="gmres").sum()), high=0.0),
    ]
    saved = data["iterations"].sel(start="zero") - data["iterations"].sel(start="isolated")
    outside = data["ratio"] >= 2.0
    for solver in tensions.SOLVERS:
        error = data["tension_error"].sel(solver=solver)
        mean = float(saved.sel(solver=solver).where(outside).mean())
        rows += [
            Row(
                f"largest error of the tensions, {solver}, from 2 d_0 on",
                float(error.where(outside).max()),
                high=1e-5,
                note="Tolerance 1e-6: on the last change, or on the residual.",
            ),
            Row(
                f"largest error of the tensions, {solver}, below 2 d_0",
                float(error.where(~outside).max()),
            ),
            Row(f"{solver} saved by a start from isolated tensions, mean from 2 d_0 on", mean),
        ]
    return rows
