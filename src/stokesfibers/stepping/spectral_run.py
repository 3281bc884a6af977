"""The high-order engine as the loop of a run wants it: nodes, views, length errors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from stokesfibers.core.arrays import Array
from stokesfibers.core.errors import InputError
from stokesfibers.core.team import ALONE, AbstractTeam
from stokesfibers.fiber.curves import Curve
from stokesfibers.fiber.parameters import Fiber
from stokesfibers.load import NoLoad
from stokesfibers.numerics.step_control import AbstractStepControl, AdaptiveSteps, FixedSteps
from stokesfibers.problem.discretised import (
    load_density,
    spectral_fibers,
    spectral_interaction,
)
from stokesfibers.problem.engine import SpectralEngine
from stokesfibers.problem.problem import Problem
from stokesfibers.slender.sampled import View
from stokesfibers.slender.spectral import Resolution, SpectralFiber
from stokesfibers.slender.spectral_interaction import AbstractSpectralInteraction
from stokesfibers.stepping.base import AbstractStepper, StepError
from stokesfibers.stepping.report import StepReport
from stokesfibers.stepping.spectral import Load, SpectralStepper
from stokesfibers.stepping.spectral_carry import Carry
from stokesfibers.stepping.spectral_view import ShownFiber
from stokesfibers.summation import FastImages

_SPATIAL_SHARE = 0.1  # of the tolerance: the error through lack of nodes that is let pass
_AIM = 0.03  # of the tolerance: the error that new nodes are chosen for
_FIXED_TOLERANCE = 1e-4  # for the nodes, where steps are fixed
_QUADRATURE_SHARE = 0.1  # of what a step may commit: the error of velocities between fibers
_FIXED_QUADRATURE = 1e-8  # of them, where steps are fixed
_GROWTH, _LEAST_CAPACITY = 4, 128  # most nodes of a run: these times the first, at least


@dataclass(frozen=True)
class _Discretised:
    """Everything on N nodes: the formulas, where fibers are shown, and which are of one kind."""

    stepper: SpectralStepper
    shown: tuple[ShownFiber, ...]
    kinds: tuple[tuple[SpectralFiber, NDArray[np.intp]], ...]

    def resolutions(self, carry: Carry) -> list[Resolution]:
        """Return how well shapes are resolved, by kind."""
        return [fiber.resolution(carry.modes[which, 0]) for fiber, which in self.kinds]


class SpectralRunStepper(AbstractStepper[Carry]):
    """Advances a problem by the high-order engine; nodes are added when shapes ask for them.

    Parameters
    ----------
    problem
        The case; its engine must be a `SpectralEngine`.
    threads
        Threads that fibers are spread over; None for all cores. Results do not depend on it.
    team
        Ranks that solve together.
    """

    dense: ClassVar[bool] = True
    stages: ClassVar[tuple[str, str]] = ("solve", "rest")

    def __init__(
        self, problem: Problem, threads: int | None = None, team: AbstractTeam = ALONE
    ) -> None:
        assert isinstance(problem.engine, SpectralEngine)
        self.problem = problem
        self._engine = problem.engine
        self._threads, self._team = threads, team
        assert self._engine.nodes is not None
        adapted = max(_GROWTH * self._engine.nodes, _LEAST_CAPACITY)
        self._capacity = adapted if self._engine.adapt_nodes else self._engine.nodes
        self._tolerance = problem.engine.rtol or _FIXED_TOLERANCE
        self._on = lru_cache(maxsize=8)(self._discretised)

    def start(self, curves: tuple[Curve, ...]) -> Carry:
        assert self._engine.nodes is not None
        carry = self._start(curves, self._engine.nodes)
        while self._engine.adapt_nodes:
            wanted = self._wanted(self._on(_nodes(carry)).resolutions(carry))
            if wanted <= _nodes(carry):
                break
            carry = self._start(curves, wanted)
        return carry

    def step(self, carry: Carry) -> tuple[Carry, StepReport]:
        while True:
            ahead, report = self._on(_nodes(carry)).stepper.step(carry)
            resolved = self._on(_nodes(carry)).resolutions(ahead)
            wanted = self._wanted(resolved) if self._engine.adapt_nodes else _nodes(carry)
            if wanted <= _nodes(carry):
                break
            carry = carry.resized(wanted)
        error = self._spatial_error(ahead, resolved)
        if not np.isfinite(error):
            raise StepError(
                f"A fiber bends, or nears itself, within its own thickness at t = {ahead.time:.6g}:"
                " the series of the finite-part operator has no limit there",
                "Slender body theory does not hold there; take thinner or stiffer fibers",
            )
        return ahead, replace(report, nodes=_nodes(carry), spatial_error=error)

    def stored(self, carry: Carry) -> dict[str, Array]:
        nodes = np.array([_nodes(carry)])
        return {**carry.resized(self._capacity).arrays(), "nodes": nodes}

    def restored(self, step: int, arrays: Mapping[str, Array]) -> Carry:
        shape = arrays["modes"].shape if "modes" in arrays else ()
        if len(shape) != 4 or shape[0] != len(self.problem.fibers):
            expected = f"the problem of the run, whose modes are {shape}"
            raise InputError("problem", expected, f"{len(self.problem.fibers)} fibers")
        held = dict(arrays)
        nodes = int(held.pop("nodes")[0])
        return Carry.restored(step, held).resized(nodes)

    def time(self, carry: Carry) -> float:
        return carry.time

    def reached(self, carry: Carry, until: float) -> bool:
        return carry.time >= until

    def view(self, carry: Carry, t: float) -> View:
        on = self._on(_nodes(carry))
        first = carry.times[1] if carry.step else carry.time
        at = float(min(max(t, first), carry.time))  # a recording time is off by rounding
        state = on.stepper.interpolate(carry, at)
        shapes = tuple(f.shape(m) for f, m in zip(on.shown, state.modes, strict=True))
        tension = [f.tension_table @ q for f, q in zip(on.shown, state.tensions, strict=True)]
        return View(t, on.shown, shapes, np.stack(tension))

    def note(self, spatial_error: float) -> str:
        if spatial_error <= self._tolerance:
            return ""
        reached = f"the error in space reached {spatial_error:.2g}, the tolerance is"
        if self._engine.adapt_nodes:
            return f"A fiber bends within a few of its radii: {reached} {self._tolerance:.2g}"
        return (
            f"The shapes ask for more nodes: {reached} {self._tolerance:.2g}. "
            "Leave discretization.nodes out, or set adapt_nodes = true"
        )

    def length_error(self, carry: Carry) -> float:
        worst = 0.0
        for fiber, which in self._on(_nodes(carry)).kinds:
            slopes = np.matmul(carry.modes[which, 0], fiber.tables[1].T)
            lengths = np.sqrt(np.square(slopes).sum(axis=1)) @ fiber.quadrature / fiber.length
            error = float(np.abs(lengths - 1.0).max())
            worst = max(worst, error) if np.isfinite(error) else np.inf
        return worst

    def _start(self, curves: tuple[Curve, ...], nodes: int) -> Carry:
        return self._on(nodes).stepper.init(tuple(curve.at_fractions for curve in curves))

    def _discretised(self, nodes: int) -> _Discretised:
        problem, engine = self.problem, self._engine
        fibers = spectral_fibers(problem, nodes)
        kinds = dict(zip(problem.fibers, fibers, strict=True))
        shown = {kind: ShownFiber.of(fiber) for kind, fiber in kinds.items()}
        control = _control(engine)
        stepper = SpectralStepper(
            fibers,
            drag=problem.drag,
            flow=problem.flow,
            control=control,
            newton_passes=engine.newton_passes,
            load=_load(problem, fibers),
            interaction=_interaction(problem, fibers, control),
            threads=self._threads,
            team=self._team,
        )
        numbers: dict[Fiber, list[int]] = {}
        for k, kind in enumerate(problem.fibers):
            numbers.setdefault(kind, []).append(k)
        return _Discretised(
            stepper,
            tuple(shown[kind] for kind in problem.fibers),
            tuple((kinds[kind], np.array(which)) for kind, which in numbers.items()),
        )

    def _wanted(self, resolved: list[Resolution]) -> int:
        """Return the number of nodes that the shapes ask for; at least the present one."""
        wanted = resolved[0].nodes
        for found in resolved:
            poor = found.error > _SPATIAL_SHARE * self._tolerance
            if poor.any():
                wanted = max(wanted, int(found.nodes_for(_AIM * self._tolerance)[poor].max()))
        return min(wanted, self._capacity)

    def _spatial_error(self, carry: Carry, resolved: list[Resolution]) -> float:
        """Return the relative error through lack of nodes and terms; not finite if it is lost."""
        worst = 0.0
        on = self._on(_nodes(carry))
        for (fiber, which), found in zip(on.kinds, resolved, strict=True):
            remainder = fiber.weights.remainder(float(carry.ratio[which].max()))
            worst = float(np.maximum(found.error.max(), max(worst, remainder)))  # NaN wins
        return worst


def _nodes(carry: Carry) -> int:
    return carry.modes.shape[-1]


def _control(engine: SpectralEngine) -> AbstractStepControl:
    if engine.dt is not None:
        assert engine.order is not None
        return FixedSteps(engine.dt, engine.order)
    assert engine.rtol is not None
    return AdaptiveSteps(engine.rtol)


def _load(problem: Problem, fibers: tuple[SpectralFiber, ...]) -> Load | None:
    """Return the external force per length at points (fiber, node, 3) and a time."""
    if isinstance(problem.load, NoLoad):
        return None
    weights = np.stack([fiber.quadrature for fiber in fibers])
    return lambda points, t: load_density(problem, points, weights, t)


def _interaction(
    problem: Problem, fibers: tuple[SpectralFiber, ...], control: AbstractStepControl
) -> AbstractSpectralInteraction:
    adaptive = isinstance(control, AdaptiveSteps)
    wanted = _QUADRATURE_SHARE * control.step_tolerance if adaptive else _FIXED_QUADRATURE
    wanted = min(1e-2, max(1e-12, wanted))
    images = problem.image_sum
    if isinstance(images, FastImages):
        return spectral_interaction(problem, fibers, images.tolerance or wanted, images)
    return spectral_interaction(problem, fibers, wanted)
