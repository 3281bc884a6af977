"""What the experiment on filaments in contact states, and the ranges it has to lie in."""

from __future__ import annotations

import numpy as np
import xarray as xr

from stokesfibers.experiments import contact_points
from stokesfibers.experiments.base import Row

_STATED = 1e-6
"""The tolerance whose errors are stated."""
EPS = 1e-3
"""The slenderness whose errors are stated and drawn."""


def rows(data: xr.Dataset) -> list[Row]:
    """Return all rows."""
    found: list[Row] = []
    for name in data["arrangement"].to_numpy():
        found += _over_tolerance(data, str(name))
        found += _at_contact(data, str(name))
    found += _points(data)
    found += _own(data)
    reference = float(data["reference_error"].max())
    note = "By panels of another order."
    return [*found, Row("relative error of the reference", reference, high=1e-11, note=note)]


def _over_tolerance(data: xr.Dataset, name: str) -> list[Row]:
    """Return the largest error of the rule over its tolerance."""
    over = data["by_rule"].sel(arrangement=name) / data["asked"]
    forces = {
        "smooth": "a force of degree 5",
        "rough": "a force of all modes, the last 1e-3 of the first",
    }
    note = "Over all eps, numbers of nodes, tolerances and gaps."
    return [
        Row(
            f"error over tolerance, largest, {name}, {label}",
            float(over.sel(force=force).max()),
            high=1.0,
            note=note,
        )
        for force, label in forces.items()
    ]


def _at_contact(data: xr.Dataset, name: str) -> list[Row]:
    """Return the errors at the smallest gap."""
    gap = float(data["gap"].min())
    here = data.sel(arrangement=name, gap=gap).sel(eps=EPS)
    paper = here["by_paper"]
    intervals = data.attrs["intervals"]
    where = f"{name}, gap {gap:g} radius, eps = {EPS:g}"
    ruled = here["by_rule"].sel(force="smooth", nodes=32, asked=_STATED)
    return [
        Row(f"error, trapezoidal, N = {intervals}, {where}", float(paper[0])),
        Row(f"error, refined, N = {intervals}, {where}", float(paper[1])),
        Row(f"error, 32 nodes alone, {where}", float(here["by_nodes"].sel(nodes=32)), low=1e-3),
        Row(f"error, rule for {_STATED:g}, {where}", float(ruled), high=_STATED),
    ]


def _points(data: xr.Dataset) -> list[Row]:
    """Return the points that each way needs, and how far down it gets."""
    found: list[Row] = []
    for place in data["place"].to_numpy():
        here = data.sel(place=place)
        series = {
            way: (data["points"].to_numpy(), here["by_points"].sel(way=way).to_numpy())
            for way in contact_points.WAYS[:2]
        }
        series["panels"] = here["panel_points"].to_numpy(), here["by_panels"].to_numpy()
        for way, (points, errors) in series.items():
            needed = points[np.argmax(errors < _STATED)] if (errors < _STATED).any() else np.nan
            found.append(Row(f"points for {_STATED:g}, {way}, {place}", float(needed)))
        for way in contact_points.WAYS[:2]:
            high = 1e-13 if way == "sinh" else None
            lowest = float(series[way][1].min())
            found.append(Row(f"smallest error, {way}, {place}", lowest, high=high))
    return found


def _own(data: xr.Dataset) -> list[Row]:
    """Return the errors of a filament's own velocity where its turns near each other."""
    note = "No rule is used for a filament's own approach."
    return [
        Row(
            f"error, own velocity, turns {float(here['own_distance']):.3f} L apart, N = {nodes}",
            float(here["own_error"].sel(own_nodes=nodes)),
            note=note,
        )
        for here in (data.isel(slope=k) for k in range(data.sizes["slope"]))
        for nodes in data["own_nodes"].to_numpy()
    ]
