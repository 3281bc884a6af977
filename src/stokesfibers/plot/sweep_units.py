"""Units of figures of a sweep whose cases have L = 1, E = 1 and mu_bar: E / L^2 for forces."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stokesfibers.core.variables import NATURAL_UNITS

if TYPE_CHECKING:
    import xarray as xr

_POWERS = {"force": (1, -2), "length": (0, 1)}  # of E and of L


def in_natural_units(data: xr.Dataset) -> xr.Dataset:
    """Return the dataset with its units written by E and L, if it says that it is in these."""
    if any(data.attrs.get(key) != unit for key, unit in NATURAL_UNITS.items()):
        return data
    found = data.copy()
    for held in found.variables.values():
        if "units" in held.attrs:
            held.attrs["units"] = _natural(str(held.attrs["units"]))
    return found


def _natural(unit: str) -> str:
    """Return ``"force length^-2"`` as ``"$E$/$L$^4"``; other units as they are."""
    rigidity = length = 0
    for part in unit.split():
        name, _, power = part.partition("^")
        if name not in _POWERS:
            return unit
        times = int(power or 1)
        rigidity += times * _POWERS[name][0]
        length += times * _POWERS[name][1]
    above = _product((rigidity, length))
    below = _product((-rigidity, -length))
    return f"{above or '1'}/{below}" if below else above or "1"


def _product(powers: tuple[int, int]) -> str:
    factors = zip(("$E$", "$L$"), powers, strict=True)
    return " ".join(f"{s}^{p}" if p > 1 else s for s, p in factors if p > 0)
