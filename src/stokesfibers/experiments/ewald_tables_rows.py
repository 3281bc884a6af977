"""The numbers of `ewald`: errors over tolerances, the estimate, the cut-offs, lattice constants."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from stokesfibers.experiments.base import Row

WASTE = 0.01
"""Of the tolerance: errors below it were paid for and not asked for."""
HASIMOTO = 2.8372974794806
"""K of the simple cubic lattice."""
PRINTED = {"simple cubic": 1.7601, "body-centred": 1.791, "face-centred": 1.791}
"""Hasimoto 1959, Sangani & Acrivos 1982: drag by ``1 - K' c^(1/3)``, c the volume fraction."""
_POINTS = {"simple cubic": 1, "body-centred": 2, "face-centred": 4}
_ESTIMATE = (0.25, 1.6)
_AGAINST = {
    "free": "all pairs",
    "one": "a long sum over images, extrapolated",
    "two": "lines of images, extrapolated",
    "three": "Hasimoto's series",
    "sheared": "the same lattice as a cell of three with right angles",
}


def rows(data: xr.Dataset) -> Sequence[Row]:
    """Return all rows."""
    return [*_errors(data), *_cutoffs(data), *_estimates(data), *_constants(data)]


def _errors(data: xr.Dataset) -> list[Row]:
    found = []
    over = data["error"] / data["tolerance"]
    for domain in data["domain"].to_numpy():
        for split in data["split"].to_numpy():
            one, errors = (v.sel(domain=domain, split=split).to_numpy() for v in (over, data.error))
            listed = ", ".join(f"{e:.1e}" for e in errors)
            note = f"Against {_AGAINST[domain]}: {listed}."
            which = f"{domain}, {split}"
            found += [
                Row(f"largest error / tolerance, {which}", one.max(), high=1.0, note=note),
                Row(f"least error / tolerance, {which}", one.min(), low=WASTE),
            ]
    return found


def _cutoffs(data: xr.Dataset) -> list[Row]:
    tolerance = data.attrs["cutoff_tolerance"]
    over = data["error_by_cutoff"] / tolerance
    cutoffs = data["cutoff"].to_numpy()
    name = f"r_c = {cutoffs[0]:g} ... {cutoffs[-1]:g} periods, tolerance {tolerance:.0e}"
    return [
        Row(
            f"largest error / tolerance, both splits, {name}, {domain}",
            float(over.sel(domain=domain).max()),
            high=1.0,
            note="The result does not depend on the split.",
        )
        for domain in data["domain"].to_numpy()
    ]


def _estimates(data: xr.Dataset) -> list[Row]:
    low, high = _ESTIMATE
    found = []
    for split in data["split"].to_numpy():
        ratio = (data["split_error"] / data["split_estimate"]).sel(split=split)
        for what, value in (("least", ratio.min()), ("largest", ratio.max())):
            note = "Even, smooth numbers of modes are a little more than asked for."
            quantity = f"{what} error / estimate, what the split leaves out, {split}"
            found.append(Row(quantity, float(value), None, low, high, note))
    return found


def _constants(data: xr.Dataset) -> list[Row]:
    found = []
    constants = data["lattice_constant"]
    off = np.abs(constants.sel(lattice="simple cubic") / HASIMOTO - 1.0) / data["tolerance"]
    found.append(
        Row(
            "Hasimoto's constant, largest relative error / tolerance",
            float(off.max()),
            high=1.0,
        )
    )
    finest = constants.isel(tolerance=-1)
    for lattice, printed in PRINTED.items():
        ours = float(finest.sel(lattice=lattice))
        fraction = ours / (4.0 * np.pi / 3.0 * _POINTS[lattice]) ** (1.0 / 3.0)
        last = 10.0 ** -len(f"{printed}".split(".")[1])
        note = f"{ours:.10f} a / L."
        quantity = f"drag of spheres on a {lattice} lattice, times c^(1/3)"
        found.append(Row(quantity, fraction, printed, printed - last, printed + last, note))
    return found
