"""Units in figures of sweeps: of quotients, and by E and L where all cases have L = 1 and E = 1."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, TypeVar

from stokesfibers.core.variables import NATURAL_UNITS

if TYPE_CHECKING:
    import xarray as xr

Held = TypeVar("Held", "xr.DataArray", "xr.Variable")


def in_natural_units(data: xr.Dataset) -> xr.Dataset:
    """Return the dataset with its units written by E and L, if it says that it is in these."""
    if not is_natural(data):
        return data
    found = data.copy()
    for held in found.variables.values():
        held.attrs = naturally(held.attrs)
    return found


def is_natural(data: xr.Dataset) -> bool:
    """Return whether the dataset says that its numbers are in units of E and L."""
    return all(data.attrs.get(key) == unit for key, unit in NATURAL_UNITS.items())


def naturally(attrs: dict[str, str]) -> dict[str, str]:
    """Return the attributes of a variable with its unit written by E and L."""
    return attrs | ({"units": _natural(attrs["units"])} if "units" in attrs else {})


def quotient(unit: str, by: str) -> str:
    """Return the unit of a quotient: ``"length"`` for ``"force length"`` by ``"force"``."""
    above, below = _powers(unit), _powers(by)
    powers = {name: above.get(name, 0) - below.get(name, 0) for name in above | below}
    return " ".join(_factors(powers.items())) or "1"


def _powers(unit: str) -> dict[str, int]:
    """Return the power of each base quantity of a unit; ``"1"`` has none."""
    parts = (part.partition("^") for part in unit.split() if part != "1")
    return {name: int(power or 1) for name, _, power in parts}


def _factors(powers: Iterable[tuple[str, int]]) -> list[str]:
    return [name if power == 1 else f"{name}^{power}" for name, power in powers if power]


def _natural(unit: str) -> str:
    """Return ``"force length^-2"`` as ``"$E$/$L$^4"``; what is neither force nor length stays."""
    powers = _powers(unit)
    force, length = powers.pop("force", 0), powers.pop("length", 0)
    both = {"$E$": force, "$L$": length - 2 * force}
    above = " ".join(_factors((name, power) for name, power in both.items() if power > 0))
    below = " ".join(_factors((name, -power) for name, power in both.items() if power < 0))
    ours = f"{above or '1'}/{below}" if below else above
    return " ".join(filter(None, [ours, *_factors(powers.items())])) or "1"
