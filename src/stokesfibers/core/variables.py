"""Registry of everything a run stores: name, axes, unit, symbol and meaning.

One entry serves the store's attributes, the axis labels of figures and the documentation.
Units are written in the base quantities length, time and force, since the core computes in any
consistent set of units; a dimensionless run has all three equal to 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Group = Literal["trajectory", "observables", "numerics", "checkpoint"]


@dataclass(frozen=True)
class Variable:
    """One stored quantity.

    Attributes
    ----------
    name
        Name in the store.
    group
        Group of the store it lives in.
    dims
        Names of its axes; the first is ``time`` or ``step`` if it grows during the run.
    unit
        Unit in base quantities, ``"1"`` for a pure number.
    symbol
        Symbol in LaTeX, without dollar signs.
    meaning
        One line for people.
    dtype
        NumPy type as stored.
    """

    name: str
    group: Group
    dims: tuple[str, ...]
    unit: str
    symbol: str
    meaning: str
    dtype: str = "float64"

    def attrs(self) -> dict[str, str]:
        """Return the attributes stored beside the array."""
        return {"units": self.unit, "symbol": self.symbol, "long_name": self.meaning}

    def label(self) -> str:
        """Return an axis label: meaning, symbol and, unless a pure number, the unit."""
        unit = "" if self.unit == "1" else f" [{self.unit}]"
        return f"{self.meaning} ${self.symbol}${unit}"


_ALL: dict[str, Variable] = {}


def register(variable: Variable) -> Variable:
    """Add `variable` to the registry and return it; a name can be taken only once."""
    key = f"{variable.group}/{variable.name}"
    if key in _ALL:
        raise ValueError(f"variable {key} is registered twice")
    _ALL[key] = variable
    return variable


def lookup(group: str, name: str) -> Variable:
    """Return the registered variable ``group/name``; KeyError if there is none."""
    return _ALL[f"{group}/{name}"]


def registered(group: str | None = None) -> tuple[Variable, ...]:
    """Return all registered variables, or those of one group, in order of registration."""
    return tuple(v for v in _ALL.values() if group is None or v.group == group)


def _trajectory(name: str, dims: tuple[str, ...], unit: str, symbol: str, meaning: str) -> None:
    register(Variable(name, "trajectory", dims, unit, symbol, meaning))


def _observable(name: str, dims: tuple[str, ...], unit: str, symbol: str, meaning: str) -> None:
    register(Variable(name, "observables", ("time", *dims), unit, symbol, meaning))


_trajectory("time", ("time",), "time", "t", "time")
_trajectory(
    "position",
    ("time", "fiber", "node", "space"),
    "length",
    r"\mathbf{x}",
    "centreline position, unwrapped",
)
_trajectory("tension", ("time", "fiber", "node"), "force", "T", "line tension")
_trajectory("arclength", ("fiber", "node"), "length", "s", "arclength")

_observable("time", (), "time", "t", "time")
_observable("elastic_energy", ("fiber",), "force length", r"E_\mathrm{elas}", "elastic energy")
_observable(
    "fiber_stress", ("fiber", "i", "j"), "force length", r"\Sigma_{ij}", "extra stress of a fiber"
)
_observable("extra_stress", ("i", "j"), "force length", r"\Sigma_{ij}", "extra stress, all fibers")
_observable(
    "first_normal_stress_difference", (), "force length", "N_1", "first normal stress difference"
)
_observable(
    "second_normal_stress_difference", (), "force length", "N_2", "second normal stress difference"
)
_observable("shear_stress", (), "force length", r"\Sigma_{12}", "shear stress")
_observable(
    "orientation_tensor",
    ("i", "j"),
    "1",
    r"\langle \mathbf{p}\mathbf{p} \rangle",
    "orientation tensor",
)
_observable("length_error", ("fiber",), "1", r"|\ell - L|/L", "relative length error")
_observable(
    "end_to_end", ("fiber", "space"), "length", r"\mathbf{x}(L)-\mathbf{x}(0)", "end-to-end vector"
)
_observable(
    "centre", ("fiber", "space"), "length", r"\bar{\mathbf{x}}", "centre of mass of a fiber"
)
_observable("largest_curvature", ("fiber",), "length^-1", r"\max\kappa", "largest curvature")
_observable("largest_tension", ("fiber",), "force", r"\max|T|", "largest tension in magnitude")

register(Variable("time", "numerics", ("step",), "time", "t", "time at the end of the step"))
register(Variable("step_size", "numerics", ("step",), "time", r"\Delta t", "step size"))
register(Variable("order", "numerics", ("step",), "1", "k", "order of the step", "int64"))
register(
    Variable("rejected", "numerics", ("step",), "1", "n_r", "rejected tries of the step", "int64")
)
register(Variable("iterations", "numerics", ("step",), "1", "n_i", "tension iterations", "int64"))
register(
    Variable("wall_time", "numerics", ("step", "stage"), "seconds", "t_w", "wall time by stage")
)
