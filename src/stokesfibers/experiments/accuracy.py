"""Error of the shapes against cost: the high-order engine and the paper's scheme.

The buckling filament of Figs. 2-4; errors are the largest distance over all material points and
times around the vertical from our own converged solution of the same model. Also the integral of
N_1 of Fig. 6 to which both engines converge.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import partial

import numpy as np
import xarray as xr
from scipy.integrate import simpson

from stokesfibers.core.arrays import Array
from stokesfibers.experiments import accuracy_figure, accuracy_rows, runs, stress
from stokesfibers.experiments.accuracy_plan import Case, Plan, plan
from stokesfibers.experiments.base import Row, Settings
from stokesfibers.experiments.engine_runs import (
    Cost,
    EngineRun,
    cost,
    largest_distance,
    shapes,
    solved,
    unit_times,
)

figure = accuracy_figure.figure
_COSTS = tuple(f.name for f in fields(Cost))
_PAPER = ("shape", "tension", "energy", "integral")
"""What the paper's scheme is compared in."""
_UNDISTURBED = 0.1


@dataclass
class _Told:
    """Tells how much is done, and keeps the times of the unit taken between runs."""

    settings: Settings
    parts: int
    units: list[Array]
    done: int = 0

    def part(self, text: str) -> Settings:
        """Say what comes next; return settings that tell of runs within that part."""
        self.units.append(unit_times())
        if self.settings.progress is not None:
            self.settings.progress(text, self.done / self.parts)
        self.done += 1
        return replace(self.settings, progress=partial(self._within, self.done - 1))

    def _within(self, done: int, text: str, share: float) -> None:
        if self.settings.progress is not None:
            self.settings.progress(text, (done + share) / self.parts)


def run(settings: Settings) -> xr.Dataset:
    """Return errors and costs of all runs of the plan."""
    chosen = plan(settings.quick)
    by_tolerance = len(chosen.rtols) + len(chosen.nodes) + 1
    told = _Told(settings, len(chosen.cases) * by_tolerance + len(chosen.aims), [])
    parts = [_case(chosen, case, told) for case in chosen.cases]
    data = xr.concat(parts, dim="case", combine_attrs="drop")
    data = data.merge(_aimed(chosen, told))
    units = np.concatenate(told.units)
    return data.assign_attrs(
        unit_smallest=float(units.min()),
        unit_median=float(np.median(units)),
        vertical=chosen.tier.vertical,
        points=chosen.points,
        quick=int(settings.quick),
    )


def check(data: xr.Dataset) -> Sequence[Row]:
    """Return errors and costs; the goals for mu_bar = 4e5; orders of the paper's scheme."""
    return accuracy_rows.rows(data)


def _case(chosen: Plan, case: Case, told: _Told) -> xr.Dataset:
    """Return everything about one model."""
    settings = told.part(f"{case.label}: references and the paper's scheme")
    known = [chosen.known(case, which) for which in (chosen.reference, chosen.control)]
    exact, control, *paper = runs.finished([*known, *chosen.by_paper(case)], settings)
    reference = shapes(exact, chosen.times, chosen.points)
    found = shapes(control, chosen.times, chosen.points)
    sums = [
        integral_of_n1(tree, chosen, every)
        for tree, every in ((exact, 1), (control, 1), (exact, 2))
    ]
    data = xr.Dataset(
        {
            "reference_error": ((), largest_distance(found, reference)),
            "integral": ((), sums[0]),
            "integral_error": ((), abs(sums[1] - sums[0]) + abs(sums[2] - sums[0])),
            "mu_bar": ((), case.mu_bar),
            "regularization": ((), case.regularization.kind),
            "skew": ((), case.skew),
            "out_of_plane": ((), float(np.ptp(reference[..., 2], axis=-1).max())),
        }
    )
    data = data.merge(_by_paper(paper, exact, chosen)).merge(
        _by_rtol(chosen, case, reference, told)
    )
    errors = []
    for nodes in chosen.nodes:
        told.part(f"{case.label}: {nodes} nodes")
        errors.append(_error(chosen.run(case, chosen.control[1], nodes), chosen, reference))
    return data.assign(space_error=(("nodes",), errors)).assign_coords(nodes=list(chosen.nodes))


def _error(run: EngineRun, chosen: Plan, reference: Array) -> float:
    return largest_distance(shapes(solved(run), chosen.times, chosen.points), reference)


def _by_rtol(chosen: Plan, case: Case, reference: Array, told: _Told) -> xr.Dataset:
    """Return errors and costs of the runs that choose their nodes."""
    errors, costs = [], []
    for rtol in chosen.rtols:
        told.part(f"{case.label}: rtol = {rtol:g}")
        one = chosen.run(case, rtol)
        errors.append(_error(one, chosen, reference))
        costs.append(cost(one, chosen.repeats))
    return _priced("rtol", errors, costs).assign_coords(rtol=list(chosen.rtols))


def _aimed(chosen: Plan, told: _Told) -> xr.Dataset:
    """Return errors and costs of the runs that aim at one error, of the first case."""
    case = chosen.cases[0]
    tree = runs.finished([chosen.known(case, chosen.reference)], told.settings)[0]
    reference = shapes(tree, chosen.times, chosen.points)
    errors, costs = [], []
    for aim, nodes, rtol in chosen.aims:
        told.part(f"{case.label}: aimed at {aim:g}")
        one = chosen.run(case, rtol, nodes)
        errors.append(_error(one, chosen, reference))
        costs.append(cost(one, chosen.repeats))
    data = _priced("aim", errors, costs)
    data["aim_rtol"] = (("aim",), [rtol for _, _, rtol in chosen.aims])
    return data.assign_coords(aim=[aim for aim, _, _ in chosen.aims])


def _priced(dim: str, errors: Sequence[float], costs: Sequence[Cost]) -> xr.Dataset:
    data = xr.Dataset({f"{dim}_error": ((dim,), list(errors))})
    for name in _COSTS:
        data[f"{dim}_{name}"] = ((dim,), [getattr(c, name) for c in costs])
    return data


def _by_paper(trees: list[xr.DataTree], exact: xr.DataTree, chosen: Plan) -> xr.Dataset:
    """Return errors of the paper's scheme by number of intervals, and its costs."""
    errors = np.array([_differences(tree, exact, chosen) for tree in trees])
    data = xr.Dataset(
        {f"paper_{name}": (("intervals",), errors[:, k]) for k, name in enumerate(_PAPER)},
        coords={"intervals": list(chosen.tier.levels)},
    )
    numerics = [tree["numerics"].to_dataset() for tree in trees]
    # All its steps cost the same: a low quantile leaves compilation and other work aside, as the
    # smallest of several runs does for the other engine.
    steps = [n["wall_time"].sum("stage") for n in numerics]
    costs = [float(each.quantile(_UNDISTURBED)) * each.size for each in steps]
    data["paper_whole"] = (("intervals",), costs)
    data["paper_steps"] = (("intervals",), [n["step_size"].size for n in numerics])
    return data


def _differences(tree: xr.DataTree, exact: xr.DataTree, chosen: Plan) -> tuple[float, ...]:
    """Return the errors in shape, tension and energy (over their largest), and the integral."""
    times, points = chosen.times, chosen.points
    shape = largest_distance(shapes(tree, times, points), shapes(exact, times, points))
    tensions = [runs.frames(t, times)["tension"].to_numpy()[:, 0] for t in (tree, exact)]
    one, other = (t[:, :: (t.shape[1] - 1) // (points - 1)] for t in tensions)
    energy, known = (runs.series(t, "elastic_energy")[1] for t in (tree, exact))
    known = known[::2]
    return (
        shape,
        float(np.abs(one - other).max() / np.abs(other).max()),
        float(np.abs(energy - known).max() / known.max()),
        integral_of_n1(tree, chosen),
    )


def integral_of_n1(tree: xr.DataTree, chosen: Plan, every: int = 1) -> float:
    """Return the integral of N_1 over the window of Fig. 6 from each `every`-th observation."""
    time, values = runs.series(tree, stress.OBSERVED["n1"])
    start, end = stress.window(chosen.tier)
    inside = (time > start - 1e-9) & (time < end + 1e-9)
    return float(simpson(values[inside][::every], x=time[inside][::every]))
