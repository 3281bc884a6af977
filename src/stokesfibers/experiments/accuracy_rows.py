"""The numbers of `accuracy`: errors, costs in units of a LAPACK solve, orders, integral of N_1."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from stokesfibers.experiments.base import Row
from stokesfibers.experiments.convergence import extrapolated
from stokesfibers.experiments.engine_runs import UNIT_SIZE

GOALS = {1e-3: 30.0, 1e-5: 100.0, 1e-7: 1200.0}
"""Cost, in units, within which an error is to be reached at mu_bar = 4e5."""
_HONEST = 10.0
_PRINTED_HALF = 579.3 / 2.0
_ORDERS = {"shape": "shape", "tension": "tension", "energy": "elastic energy"}
_INTEGRALS = {"spheroidal": 290.4471, "paper": 290.4531}
_SIXTH_DIGIT = 5e-4
_LEFT = 0.2


def rows(data: xr.Dataset) -> Sequence[Row]:
    """Return all rows."""
    found: list[Row] = []
    for k in range(data.sizes["case"]):
        found += _of_tolerances(data.isel(case=k), data)
    first = data.isel(case=0)
    found += _of_aims(first, data)
    for k in range(data.sizes["case"]):
        found += _of_paper(data.isel(case=k), data)
    found.append(_ratio(first))
    for k in range(data.sizes["case"]):
        found += _of_integral(data.isel(case=k), bool(data.attrs["quick"]))
    return found


def label(case: xr.Dataset) -> str:
    """Return what a row calls a case."""
    delta = {"paper": "(16)"}.get(str(case["regularization"].values), "spheroidal")
    name = f"mu_bar = {float(case['mu_bar']):.0e}, {delta}".replace("e+0", "e")
    return f"{name}, 3D" if float(case["skew"]) else name


def _of_tolerances(case: xr.Dataset, data: xr.Dataset) -> list[Row]:
    known = Row(
        f"error of the reference, {label(case)}",
        float(case["reference_error"]),
        high=1e-4 * float(data["rtol"].max()) if data.attrs["quick"] else 5e-8,
        note="Distance of the run with fewer nodes and a larger tolerance from it.",
    )
    found = [known]
    if float(case["skew"]):
        extent, quick = float(case["out_of_plane"]), data.attrs["quick"]
        name = f"largest extent across the plane of shear, {label(case)}"
        found.append(Row(name, extent, low=0.01 if quick else 0.03))
    for one in (case.isel(rtol=k) for k in range(case.sizes["rtol"])):
        rtol = float(one["rtol"])
        found.append(
            Row(
                f"shape error, rtol = {rtol:.0e}, {label(case)}",
                float(one["rtol_error"]),
                high=_HONEST * rtol,
                note=_cost_note(one, "rtol"),
            )
        )
    return found


def _of_aims(case: xr.Dataset, data: xr.Dataset) -> list[Row]:
    found = []
    for one in (case.isel(aim=k) for k in range(case.sizes["aim"])):
        aim = float(one["aim"])
        units = float(one["aim_formulas"] / one["aim_unit"])
        name = f"error {aim:.0e}, {label(case)}"
        how = f"rtol = {float(one['aim_rtol']):g}; {_cost_note(one, 'aim')}"
        found.append(
            Row(f"shape error of the run aimed at {name}", float(one["aim_error"]), high=aim)
        )
        found.append(
            Row(
                f"cost in LAPACK solves of size {UNIT_SIZE}, {name}",
                units,
                high=None if data.attrs["quick"] else GOALS.get(aim),
                note=how,
            )
        )
    return found


def _of_paper(case: xr.Dataset, data: xr.Dataset) -> list[Row]:
    found = []
    for one in (case.isel(intervals=k) for k in range(case.sizes["intervals"])):
        units = float(one["paper_whole"]) / data.attrs["unit_smallest"]
        found.append(
            Row(
                f"shape error of the paper's scheme, N = {int(one['intervals'])}, {label(case)}",
                float(one["paper_shape"]),
                note=f"{int(one['paper_steps'])} steps, {units:.0f} units.",
            )
        )
    band = (1.3, 3.5) if data.attrs["quick"] else (1.7, 2.4)
    for name, called in _ORDERS.items():
        errors = case[f"paper_{name}"].to_numpy()
        order = float(np.log2(errors[-2] / errors[-1]))
        found.append(
            Row(
                f"order of the paper's scheme to the reference, {called}, {label(case)}",
                order,
                None,
                *band,
                note=f"Errors {', '.join(f'{e:.2g}' for e in errors)}.",
            )
        )
    return found


def _ratio(case: xr.Dataset) -> Row:
    """Return how many times cheaper the same error is as the paper's finest run."""
    error, seconds = float(case["paper_shape"][-1]), float(case["paper_whole"][-1])
    every = [
        *zip(case["rtol_error"].to_numpy(), case["rtol_whole"].to_numpy(), strict=True),
        *zip(case["aim_error"].to_numpy(), case["aim_whole"].to_numpy(), strict=True),
    ]
    enough = [whole for reached, whole in every if reached <= error]
    cheapest = min(enough) if enough else float("nan")
    intervals = int(case["intervals"][-1])
    return Row(
        f"wall time of the paper's scheme, N = {intervals}, over the cheapest run of its error",
        seconds / cheapest,
        low=1.0,
        note=f"{error:.1e} in {seconds:.3g} s against {cheapest:.3g} s, {label(case)}.",
    )


def _of_integral(case: xr.Dataset, quick: bool) -> list[Row]:
    ours = float(case["integral"])
    kind, paper = str(case["regularization"].values), case["paper_integral"].to_numpy()
    errors = np.abs(paper - ours)
    figure6 = not quick and float(case["mu_bar"]) == 4e5 and not float(case["skew"])
    low = _INTEGRALS[kind] - _SIXTH_DIGIT if figure6 else None
    high = _INTEGRALS[kind] + _SIXTH_DIGIT if figure6 else None
    printed = _PRINTED_HALF if figure6 and kind == "paper" else None
    return [
        Row(
            f"integral of N1, {label(case)}",
            ours,
            printed,
            low,
            high,
            note=f"Error {float(case['integral_error']):.1e}. Paper: half of what it prints."
            if printed
            else f"Error {float(case['integral_error']):.1e}.",
        ),
        Row(
            f"order of the paper's scheme to the integral of N1, {label(case)}",
            float(np.log2(errors[-2] / errors[-1])),
            None,
            *((None, None) if quick else (1.8, 2.2)),
            note=f"{', '.join(f'{value:.2f}' for value in paper)}.",
        ),
        Row(
            f"what Richardson leaves of the finest error of that integral, {label(case)}",
            abs(extrapolated(paper[-2], paper[-1]) - ours) / errors[-1],
            high=None if quick else _LEFT,
            note="The orders allowed, 1.8 to 2.2, leave 0.17 and 0.2.",
        ),
    ]


def _cost_note(one: xr.Dataset, dim: str) -> str:
    whole, formulas, unit = (float(one[f"{dim}_{n}"]) for n in ("whole", "formulas", "unit"))
    nodes, steps = int(one[f"{dim}_nodes"]), int(one[f"{dim}_steps"])
    return (
        f"{nodes} nodes, {steps} steps; {formulas:.3g} s ({formulas / unit:.0f} units), "
        f"with all checks {whole:.3g} s ({whole / unit:.0f})."
    )
