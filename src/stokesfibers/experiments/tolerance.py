"""Whether the error asked for is the error got: the high-order engine over varied cases.

The true error is the largest distance over all material points from a run of the same case at a
much smaller tolerance, in units of the fiber's length: at the end, and the largest of the run. It
may exceed the tolerance by a factor of ten at most. The relative error of the length may not
exceed ten times its square: after each step, and in what is recorded between steps.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from stokesfibers.core.arrays import Array
from stokesfibers.core.errors import StokesFibersError
from stokesfibers.experiments.base import Row, Settings
from stokesfibers.experiments.tolerance_cases import CASES, QUICK_CASES, ToleranceCase
from stokesfibers.run.schedule import Schedule
from stokesfibers.run.simulate import simulate

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FACTOR = 10.0
"""By which a true error may exceed the tolerance."""
LEAST_LENGTH_ERROR = 1e-8
_RECORDS = 64
_DOT = {"marker": ".", "markersize": 2.2, "alpha": 0.6}


@dataclass(frozen=True)
class Plan:
    """What is computed.

    Attributes
    ----------
    cases
        Problems.
    rtols
        Tolerances asked for.
    reference
        Tolerance of the runs that errors are told from.
    """

    cases: tuple[ToleranceCase, ...]
    rtols: tuple[float, ...]
    reference: float


_FULL = Plan(CASES, (1e-2, 1e-3, 1e-4, 1e-5, 1e-6), 1e-8)
_QUICK = Plan(QUICK_CASES, (1e-2, 1e-4), 1e-6)


@dataclass(frozen=True)
class _Outcome:
    positions: Array  # (time, fiber, point, space)
    length_error: float
    recorded_length_error: float
    nodes: int
    steps: int


def run(settings: Settings) -> xr.Dataset:
    """Return true errors, length errors, nodes and steps by case and tolerance."""
    plan = _QUICK if settings.quick else _FULL
    shape = len(plan.cases), len(plan.rtols)
    errors, passing, lengths, recorded = np.empty((4, *shape))
    nodes, steps = np.empty(shape, dtype=int), np.empty(shape, dtype=int)
    for k, case in enumerate(plan.cases):
        if settings.progress is not None:
            settings.progress(f"{case.name}, mu_bar = {case.mu_bar:g}", k / len(plan.cases))
        reference = _solved(case, plan.reference).positions
        for j, rtol in enumerate(plan.rtols):
            found = _solved(case, rtol)
            apart = np.linalg.norm(found.positions - reference, axis=-1)
            errors[k, j], passing[k, j] = apart[-1].max(), apart.max()
            lengths[k, j] = found.length_error
            recorded[k, j] = found.recorded_length_error
            nodes[k, j], steps[k, j] = found.nodes, found.steps
    axes = ("case", "rtol")
    return xr.Dataset(
        {
            "error": (axes, errors),
            "passing_error": (axes, passing),
            "length_error": (axes, lengths),
            "recorded_length_error": (axes, recorded),
            "nodes": (axes, nodes),
            "steps": (axes, steps),
            "name": (("case",), [case.name for case in plan.cases]),
            "mu_bar": (("case",), [case.mu_bar for case in plan.cases]),
            "eps": (("case",), [case.eps for case in plan.cases]),
        },
        coords={"rtol": list(plan.rtols)},
        attrs={"reference": plan.reference, "quick": int(settings.quick)},
    )


def _solved(case: ToleranceCase, rtol: float) -> _Outcome:
    """Return where the fibers of a case end, and how they got there."""
    length_errors: list[float] = []
    result = simulate(
        case.problem(rtol),
        case.curves(),
        until=case.until,
        record=Schedule(case.until / _RECORDS, case.until / _RECORDS),
        watch=lambda moment: length_errors.append(moment.length_error),
        threads=1,
    )
    if result.status.code == "interrupted":
        raise KeyboardInterrupt
    if not result.status.ok:
        raise StokesFibersError(f"{case.name}, rtol = {rtol:g}: {result.status.explanation}")
    data = result.data
    numerics, observables = data["numerics"].to_dataset(), data["observables"].to_dataset()
    return _Outcome(
        positions=data["trajectory"]["position"].to_numpy(),
        length_error=max(length_errors),
        recorded_length_error=float(observables["length_error"].max()),
        nodes=int(numerics["nodes"][-1]),
        steps=numerics["step_size"].size,
    )


def allowed_length_error(rtol: Array) -> Array:
    """Return the largest relative length error that a run at `rtol` may have."""
    return np.maximum(LEAST_LENGTH_ERROR, FACTOR * rtol**2)


def check(data: xr.Dataset) -> Sequence[Row]:
    """Return the worst true error over the tolerance and the worst length error, by case."""
    rtol = data["rtol"].to_numpy()
    rows = []
    ratios = data["error"].to_numpy() / rtol
    asked = ", ".join(f"{r:.0e}" for r in rtol)
    for k, ratio in enumerate(ratios):
        name = label(data, k)
        used = ", ".join(str(n) for n in data["nodes"].to_numpy()[k])
        each = ", ".join(f"{r:.2g}" for r in ratio)
        rows.append(
            Row(
                f"worst true error over rtol, {name}",
                float(ratio.max()),
                high=FACTOR,
                note=f"rtol = {asked}: {each}; nodes {used}.",
            )
        )
        passing = float((data["passing_error"].to_numpy()[k] / rtol).max())
        rows.append(Row(f"the same, largest of the run, {name}", passing, high=FACTOR))
        rows += _of_lengths(data.isel(case=k), name)
    rows += [
        Row("true error over rtol, largest of all", float(ratios.max()), high=FACTOR),
        Row("true error over rtol, median", float(np.median(ratios))),
        Row("true error over rtol, smallest of all", float(ratios.min())),
        Row(
            "share of runs within a factor of ten of rtol, both sides",
            float(((ratios <= FACTOR) & (ratios >= 1.0 / FACTOR)).mean()),
            note="The others are more accurate than asked for.",
        ),
    ]
    return rows


def _of_lengths(case: xr.Dataset, name: str) -> list[Row]:
    allowed = allowed_length_error(case["rtol"].to_numpy())
    at_steps, recorded = (
        float((case[which].to_numpy() / allowed).max())
        for which in ("length_error", "recorded_length_error")
    )
    return [
        Row(f"worst length error over what is allowed, {name}", at_steps, high=1.0),
        Row(f"the same of what is recorded between steps, {name}", recorded, high=1.0),
    ]


def label(data: xr.Dataset, k: int) -> str:
    """Return what a row calls case `k`."""
    one = data.isel(case=k)
    mu_bar = f"{float(one['mu_bar']):.2g}".replace("e+0", "e")
    return f"{one['name'].values!s}, mu_bar = {mu_bar}, eps = {float(one['eps']):.2g}"


def figure(data: xr.Dataset) -> Figure:
    """Draw true errors and length errors against the tolerance, by flow, with what is allowed."""
    from stokesfibers.plot.style import FAINT, INK, PAGE, new_panels, style

    left, right = new_panels(1, 2, width=PAGE, height=3.0)[0]
    rtol = data["rtol"].to_numpy()
    wide = np.array([0.4 * rtol.min(), 2.5 * rtol.max()])
    with style():
        left.fill_between(wide, wide / FACTOR, wide * FACTOR, color=FAINT, alpha=0.2, linewidth=0)
        left.loglog(wide, wide, color=FAINT, linewidth=0.7)
        left.loglog(wide, FACTOR * wide, color=INK, linewidth=0.7)
        fine = np.geomspace(wide[0], wide[1], 100)
        right.loglog(fine, allowed_length_error(fine), color=INK, linewidth=0.7)
        named = set()
        for k in range(data.sizes["case"]):
            flow, look = _look(data, k)
            told = {"label": flow} if flow not in named else {}
            named.add(flow)
            left.loglog(rtol * _aside(data, k), data["error"][k], **look, **told)
            left.loglog(rtol * _aside(data, k), data["passing_error"][k], **(look | _DOT))
            right.loglog(rtol * _aside(data, k), data["length_error"][k].clip(1e-16), **look)
            recorded = data["recorded_length_error"][k]
            right.loglog(rtol * _aside(data, k), recorded, **(look | _DOT))
        left.set(xlabel="tolerance asked for", ylabel="true error", xlim=wide)
        right.set(xlabel="tolerance asked for", ylabel="largest error of the length", xlim=wide)
        left.plot([], [], color=INK, linewidth=0.7, label="allowed")
        left.plot([], [], color=INK, linestyle="", **_DOT, label="largest of the run")
        left.legend(loc="lower right")
        right.plot([], [], color=INK, linestyle="", **_DOT, label="recorded between steps")
        right.legend(loc="lower right")
    return left.figure


def _aside(data: xr.Dataset, k: int) -> float:
    """Return a factor near 1 that sets the points of a case beside those of the others."""
    count = data.sizes["case"]
    return 10.0 ** (0.4 * (k / max(1, count - 1) - 0.5))


def _look(data: xr.Dataset, k: int) -> tuple[str, dict[str, Any]]:
    """Return the flow of a case, and its marker; hollow for local drag, half for two fibers."""
    from stokesfibers.plot.style import PALETTE

    name = str(data["name"][k].values)
    flow = name.split(",")[0].removeprefix("uniaxial ")
    place = ("shear", "extension", "oscillating shear", "gravity").index(flow)
    look: dict[str, Any] = {"color": PALETTE[place], "marker": "osD^"[place], "linestyle": ""}
    hollow = {"markerfacecolor": "white"} if "drag" in name else {}
    half = {"fillstyle": "left"} if "2 fibers" in name else {}
    return flow, {**look, "markersize": 3.0, "markeredgewidth": 0.7, **hollow, **half}
