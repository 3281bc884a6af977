"""Registry of everything a run stores: name, axes, unit, symbol and meaning.

One entry serves the store's attributes, the axis labels of figures and the documentation.
Units are written in the base quantities length, time and force, since the core computes in any
consistent set of units; a dimensionless run has all three equal to 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

NATURAL_UNITS = {"unit_of_length": "L", "unit_of_force": "E/L^2"}
"""Attributes of a dataset all of whose cases have L = 1, E = 1 and mu_bar: what numbers are in."""

NATURAL_RATES = {
    "1/rate": r"\dot\gamma",
    "1/|rate|": r"|\dot\gamma|",
    "1/amplitude": r"\dot\gamma_0",
    "1/|amplitude|": r"|\dot\gamma_0|",
}
"""Symbol of the flow's rate by the attribute ``unit_of_time``, if all cases have a rate of 1."""

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


_TRAJECTORY: tuple[tuple[str, tuple[str, ...], str, str, str], ...] = (
    ("time", ("time",), "time", "t", "time"),
    (
        "position",
        ("time", "fiber", "node", "space"),
        "length",
        r"\mathbf{x}",
        "centreline position, unwrapped",
    ),
    ("tension", ("time", "fiber", "node"), "force", "T", "line tension"),
    ("arclength", ("fiber", "node"), "length", "s", "arclength"),
)

# The axis ``time`` comes first and is left out here.
_OBSERVABLES: tuple[tuple[str, tuple[str, ...], str, str, str], ...] = (
    ("time", (), "time", "t", "time"),
    ("elastic_energy", ("fiber",), "force length", r"E_\mathrm{elas}", "elastic energy"),
    (
        "fiber_stress",
        ("fiber", "i", "j"),
        "force length",
        r"\Sigma_{ij}",
        "extra stress of a fiber",
    ),
    ("extra_stress", ("i", "j"), "force length", r"\Sigma_{ij}", "extra stress, all fibers"),
    (
        "first_normal_stress_difference",
        (),
        "force length",
        "N_1",
        "first normal stress difference",
    ),
    (
        "second_normal_stress_difference",
        (),
        "force length",
        "N_2",
        "second normal stress difference",
    ),
    ("shear_stress", (), "force length", r"\Sigma_{12}", "shear stress"),
    ("intrinsic_viscosity", (), "1", r"[\eta]", "intrinsic viscosity per $nL^3$"),
    ("specific_viscosity", (), "1", r"\eta_r - 1", "specific viscosity"),
    (
        "orientation_tensor",
        ("i", "j"),
        "1",
        r"\langle \mathbf{p}\mathbf{p} \rangle",
        "orientation tensor",
    ),
    ("order_parameter", (), "1", "S", "nematic order parameter"),
    ("length_error", ("fiber",), "1", r"|\ell - L|/L", "relative length error"),
    (
        "end_to_end",
        ("fiber", "space"),
        "length",
        r"\mathbf{x}(L)-\mathbf{x}(0)",
        "end-to-end vector",
    ),
    (
        "end_to_end_distance",
        ("fiber",),
        "length",
        "R",
        "end-to-end distance",
    ),
    ("centre", ("fiber", "space"), "length", r"\bar{\mathbf{x}}", "centre of mass of a fiber"),
    ("largest_curvature", ("fiber",), "length^-1", r"\max\kappa", "largest curvature"),
    ("smallest_distance", (), "length", r"d_\mathrm{min}", "smallest centreline distance"),
    ("smallest_gap", (), "length", r"g_\mathrm{min}", "smallest gap between surfaces"),
    (
        "particle_stress",
        ("i", "j"),
        "force length^-2",
        r"\Sigma^p_{ij}",
        "extra stress per volume",
    ),
    ("strain", (), "1", r"\gamma", "strain of the sheared cell"),
    ("largest_tension", ("fiber",), "force", r"\max|T|", "largest tension in magnitude"),
    ("force_error", (), "1", r"\epsilon_F", "net elastic force of a fiber, relative, largest"),
    ("torque_error", (), "1", r"\epsilon_M", "net elastic torque of a fiber, relative, largest"),
    ("energy_error", (), "1", r"\epsilon_E", "energy missing so far over energy dissipated"),
    ("motion_error", (), "1", r"\epsilon_v", "distance off the equation of motion so far"),
)

_NUMERICS: tuple[tuple[str, tuple[str, ...], str, str, str, str], ...] = (
    ("time", ("step",), "time", "t", "time at the end of the step", "float64"),
    ("step_size", ("step",), "time", r"\Delta t", "step size", "float64"),
    ("order", ("step",), "1", "k", "order of the step", "int64"),
    ("rejected", ("step",), "1", "n_r", "rejected tries of the step", "int64"),
    ("iterations", ("step",), "1", "n_i", "tension iterations", "int64"),
    ("wall_time", ("step", "stage"), "s", "t_w", "wall time by stage", "float64"),
    ("nodes", ("step",), "1", "N", "nodes per fiber", "int64"),
    (
        "spatial_error",
        ("step",),
        "1",
        r"\epsilon_s",
        "estimated relative error in space",
        "float64",
    ),
    (
        "cutoff",
        ("step",),
        "length",
        "r_c",
        "distance to which pairs are summed one by one; infinite if all are",
        "float64",
    ),
    ("modes", ("step",), "1", "M", "Fourier modes that sum the rest", "int64"),
)

for _name, _dims, *_rest in _TRAJECTORY:
    register(Variable(_name, "trajectory", _dims, *_rest))
for _name, _dims, *_rest in _OBSERVABLES:
    register(Variable(_name, "observables", ("time", *_dims), *_rest))
for _name, _dims, *_rest in _NUMERICS:
    register(Variable(_name, "numerics", _dims, *_rest))
