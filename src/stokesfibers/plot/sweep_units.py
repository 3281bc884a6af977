"""Units in figures of sweeps: of quotients, and by E, L and the flow's rate where these are 1."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from stokesfibers.core.variables import NATURAL_RATES, NATURAL_UNITS

if TYPE_CHECKING:
    import xarray as xr

_BASE = ("force", "length", "time")
_GROUPS = re.compile(r"\{[^{}]*\}|\([^()]*\)|\[[^\[\]]*\]|\|[^|]*\|")


def in_natural_units(data: xr.Dataset) -> xr.Dataset:
    """Return the dataset with symbols over natural scales, if it says that it is in these."""
    scales = natural_scales(data)
    if not scales:
        return data
    found = data.copy()
    for held in found.variables.values():
        held.attrs = naturally(held.attrs, scales)
    return found


def natural_scales(data: xr.Dataset) -> dict[str, str]:
    """Return the symbols of the scales that are 1 in all cases: E, L, and perhaps the rate."""
    if any(data.attrs.get(key) != unit for key, unit in NATURAL_UNITS.items()):
        return {}
    rate = NATURAL_RATES.get(data.attrs.get("unit_of_time", ""))
    return {"E": "E", "L": "L"} | ({} if rate is None else {"rate": rate})


def naturally(attrs: Mapping[str, str], scales: Mapping[str, str]) -> dict[str, str]:
    """Return the attributes of a variable that is divided by what is natural for its unit.

    Its symbol then says so, such as ``N_1 L / E``, and there is no unit; without a symbol, or in a
    unit of more than these scales, the unit is written by them.
    """
    found = dict(attrs)
    powers = _powers(attrs.get("units", "1"))
    if not scales or not {*powers} & {*_BASE}:
        return found
    force, length = powers.pop("force", 0), powers.pop("length", 0)
    ours = {"rate": 0, "E": force, "L": length - 2 * force}
    if "rate" in scales:
        ours["rate"] = -powers.pop("time", 0)
    above = [(scales[one], power) for one, power in ours.items() if power > 0]
    below = [(scales[one], -power) for one, power in ours.items() if power < 0]
    if attrs.get("symbol") and not powers:
        top, _, bottom = attrs["symbol"].partition(" / ")
        top = bracketed(top)
        over = [*filter(None, [bottom]), *map(_raised, above)]
        # as it is usually written: the rate before the time, E and L behind what they scale
        before = [_raised(one) for one in below if one[0] == scales.get("rate")]
        after = [_raised(one) for one in below if one[0] != scales.get("rate")]
        return found | {"symbol": _fraction([*before, top, *after], over), "units": "1"}
    ratio = _fraction(list(map(_raised, above)), list(map(_raised, below)))
    ours_written = [f"${ratio}$"] if above or below else []
    return found | {"units": " ".join([*ours_written, *_factors(powers.items())])}


def bracketed(symbol: str) -> str:
    """Return a symbol as a factor: a sum or difference in brackets, if it is in none yet."""
    bare, count = symbol, 1
    while count:
        bare, count = _GROUPS.subn("", bare)
    return f"({symbol})" if re.search(r"[+-]", bare) else symbol


def _raised(factor: tuple[str, int]) -> str:
    symbol, power = factor
    return symbol if power == 1 else f"{symbol}^{{{power}}}"


def _fraction(above: list[str], below: list[str]) -> str:
    over = r" \, ".join(above) or "1"
    under = r" \, ".join(below)
    return f"{over} / {f'({under})' if len(below) > 1 else under}" if below else over


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
