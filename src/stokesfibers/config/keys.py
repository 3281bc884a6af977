"""Registry of the keys of a case file: path, unit, symbol and meaning, one line each.

It names swept keys in datasets and finds the path that was meant when one is nearly right. A test
holds it against the JSON Schema, so that no key is missing and none is too many.
"""

from __future__ import annotations

import difflib
import re
from dataclasses import dataclass, replace

from stokesfibers.core.errors import InputError

_PLACE = re.compile(r"\[\d+\]|\.\d+(?=\.|$)")
_ENTRY = re.compile(r"(?:\[|\.)(\d+)\]?$")
_MOST_NAMED = 3


@dataclass(frozen=True)
class CaseKey:
    """A key of the case file.

    Attributes
    ----------
    path
        ``"table.key"``, as in ``--set`` and in error messages.
    unit
        Unit in base quantities as in `core.variables`, ``"1"`` for a pure number, empty for text.
    symbol
        Symbol in LaTeX, without dollar signs; may be empty.
    meaning
        One line for people.
    """

    path: str
    unit: str
    symbol: str
    meaning: str

    def attrs(self) -> dict[str, str]:
        """Return what is stored beside values of this key; what is empty is left out."""
        found = {"units": self.unit, "symbol": self.symbol, "long_name": self.meaning}
        return {name: text for name, text in found.items() if text}


_ALL = (
    ("engine", "", "", "engine"),
    ("fiber.length", "length", "L", "length of the fiber"),
    ("fiber.slenderness", "1", r"\varepsilon", "slenderness"),
    ("fiber.radius", "length", "a", "radius at mid-length"),
    ("fiber.rigidity", "force length^2", "E", "bending rigidity"),
    ("fiber.count", "1", "", "number of fibers"),
    ("fluid.mu_bar", "1", r"\bar\mu", "effective viscosity"),
    ("fluid.viscosity", "force time length^-2", r"\mu", "viscosity of the fluid"),
    ("flow.kind", "", "", "kind of flow"),
    ("flow.rate", "time^-1", r"\dot\gamma", "rate of the flow"),
    ("flow.amplitude", "time^-1", r"\dot\gamma_0", "largest rate of the flow"),
    ("flow.frequency", "time^-1", "f", "frequency of the flow"),
    ("flow.angular_velocity", "time^-1", r"\omega", "angular velocity of the flow"),
    ("flow.velocity", "", "", "velocity of the flow, or name of the function that gives it"),
    ("flow.gradient", "", "", "name of the function that gives the flow's gradient"),
    ("flow.file", "", "", "Python file of the flow"),
    ("flow.sha256", "", "", "checksum of the flow's Python file"),
    ("flow.flows", "", "", "flows that add up"),
    ("domain.kind", "", "", "kind of domain"),
    ("domain.periods", "length", "", "periods of the domain"),
    ("domain.strain", "1", r"\gamma", "strain of the cell at the start"),
    ("domain.sum", "", "", "way to sum over images"),
    ("domain.reach", "1", "Q", "images included on each side"),
    ("domain.about", "", "", "point that stands for a far image"),
    ("domain.tolerance", "1", "", "tolerance of the fast sum"),
    ("domain.split", "", "", "split of the fast sum"),
    ("domain.cutoff", "length", "r_c", "cutoff of the fast sum's near part"),
    ("load.kind", "", "", "kind of load"),
    ("load.force", "force length^-1", r"\mathbf{g}", "load per length"),
    ("load.strength", "force length^-2", "A", "strength of the repulsion"),
    ("load.range", "length", "w", "range of the repulsion"),
    ("load.file", "", "", "Python file of the load"),
    ("load.density", "", "", "name of the function that gives the load"),
    ("load.sha256", "", "", "checksum of the load's Python file"),
    ("initial.kind", "", "", "kind of initial shapes"),
    ("initial.angle", "rad", r"\theta_0", "initial angle to the x-axis"),
    ("initial.tilt", "rad", r"\phi_0", "initial tilt"),
    ("initial.amplitude", "1", "d_y", "256 initial bend / L"),
    ("initial.centre", "length", "", "initial mid-point"),
    ("initial.seed", "1", "", "seed of the initial shapes"),
    ("initial.box", "length", "", "initial box"),
    ("initial.cells", "1", "", "cells of the initial lattice"),
    ("initial.orientation", "", "", "initial orientation"),
    ("initial.orientation.kind", "", "", "kind of initial orientation"),
    ("initial.orientation.axis", "1", "", "axis of the initial orientation"),
    ("initial.orientation.normal", "1", "", "normal of the plane of initial orientations"),
    ("initial.orientation.concentration", "1", r"\kappa", "concentration about the axis"),
    ("initial.least_gap", "length", "", "least gap between surfaces at the start"),
    ("initial.path", "", "", "file of the initial shapes"),
    ("model.mobility", "", "", "mobility"),
    ("model.regularization.kind", "", "", "kind of regularization"),
    ("model.regularization.m", "1", "m", "regularization at mid-length over the radius"),
    ("model.regularization.ramp", "1", "", "fraction of the length of the regularization's ramp"),
    ("model.regularization.allow_small_m", "", "", "whether a small m is accepted"),
    ("model.close_approach.kind", "", "", "kind of blend at close approach"),
    ("model.close_approach.d0", "length", "d_0", "distance where the blend begins"),
    ("model.close_approach.near", "1", "", "intervals within which near ones are cut"),
    ("model.close_approach.parts", "1", "", "parts of an interval that is cut"),
    ("constraint.beta", "time^-1", r"\beta", "penalisation of length errors"),
    ("constraint.solver", "", "", "solver of the coupled tensions"),
    ("constraint.tolerance", "1", "", "tolerance of the coupled tensions"),
    ("constraint.most", "1", "", "most sweeps of the coupled tensions"),
    ("discretization.intervals", "1", "N", "intervals of a fiber"),
    ("discretization.nodes", "1", "N", "nodes of a fiber"),
    ("discretization.adapt_nodes", "", "", "whether nodes are added"),
    ("stepping.dt", "time", r"\Delta t", "time step"),
    ("stepping.rtol", "1", "", "relative tolerance"),
    ("stepping.order", "1", "", "order of the fixed step"),
    ("stepping.newton_passes", "1", "", "passes of Newton's method in a step"),
    ("stepping.until", "time", "", "time to stop"),
    ("stepping.cycles", "1", "", "cycles of the flow"),
    ("record.positions_every", "time", "", "time between records of positions"),
    ("record.observables_every", "time", "", "time between records of observables"),
    ("record.checkpoint_every", "time", "", "time between checkpoints"),
    ("record.points", "1", "", "output points of a fiber"),
    ("stop.observable", "", "", "observable that stops the run"),
    ("stop.above", "", "", "value above which the run stops"),
    ("stop.below", "", "", "value below which the run stops"),
)
KEYS = {path: CaseKey(path, unit, symbol, meaning) for path, unit, symbol, meaning in _ALL}
"""All keys by path."""
TABLES = frozenset(path.partition(".")[0] for path in KEYS)
"""What stands at the top of a case file."""


def key_at(path: str) -> CaseKey | None:
    """Return the key at a path, which may count entries of lists, as in ``fiber[1].length``.

    An entry of a vector, ``load.force.1`` or ``load.force[1]``, says which in its meaning.
    """
    key, entry = KEYS.get(_PLACE.sub("", path)), _ENTRY.search(path)
    if key is None or entry is None:
        return key
    place = int(entry[1])
    which = f"along {'xyz'[place]}" if place < 3 else f"entry {place}"
    return replace(key, path=path, symbol="", meaning=f"{key.meaning}, {which}")


def refuse_misplaced(path: str, given: str) -> None:
    """Refuse a path that is none, if its last key belongs somewhere else.

    Parameters
    ----------
    path
        A key or ``table.key``; others are let through.
    given
        What the user wrote.

    Raises
    ------
    InputError
        With the paths that may have been meant.
    """
    path = _PLACE.sub("", path)
    table, _, key = path.rpartition(".")
    if path in KEYS or path in TABLES or "." in table:
        return
    ends: dict[str, list[str]] = {}
    for known in KEYS:
        ends.setdefault(known.rpartition(".")[2], []).append(known)
    near = [] if table else difflib.get_close_matches(key, [*ends, *TABLES], n=1)
    found = ends.get(key) or [known for end in near for known in ends.get(end, ())]
    if found:
        names = [f"'{known}'" for known in found[:_MOST_NAMED]]
        more = ", ..." if len(found) > _MOST_NAMED else ""
        hint = f"Did you mean {' or '.join(names)}{more}?"
        raise InputError("--set", "table.key=value with a key of the case", repr(given), hint)
