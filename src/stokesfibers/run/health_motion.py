"""The model's own velocity beside that of a run: what the balance of power is found from.

The mobility is evaluated anew from shapes and tensions, with weights, near corrections and sums
between fibers of its own, so that an error of a step, of its solve or of its sums is seen.
A fiber's own operator is evaluated on the run's nodes for the power, which balances there, and on
more nodes for the motion (`health_nodes`), so that an error of its quadrature is seen as well.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from stokesfibers.core.arrays import Array
from stokesfibers.core.parallel import Workers
from stokesfibers.observe.balance import Balance, Motion
from stokesfibers.problem.discretised import (
    load_density,
    spectral_fibers,
    spectral_interaction,
)
from stokesfibers.problem.engine import PaperEngine
from stokesfibers.problem.problem import Problem
from stokesfibers.run.health_nodes import MoreNodes
from stokesfibers.slender.spectral import SpectralFiber
from stokesfibers.slender.spectral_forces import (
    elastic_forces,
    force_units,
    node_positions,
    resisted_forces,
)
from stokesfibers.slender.spectral_interaction import AbstractSpectralInteraction
from stokesfibers.stepping.base import AbstractStepper
from stokesfibers.stepping.paper import Carry as PaperCarry
from stokesfibers.stepping.paper import PaperStepper
from stokesfibers.stepping.spectral_carry import Carry, combined

_ONE_MORE = 2  # states beyond the order that the rate is taken from: better than the step itself
_SHARE = 0.1  # of the tolerance: error of the velocities between fibers
_FIXED_TOLERANCE = 1e-4  # where steps are fixed

Weigh = Callable[[Any], Balance | None]
"""Takes the carry behind a step; None where it says nothing."""


def balance_of(stepper: AbstractStepper[Any], threads: int | None) -> Weigh:
    """Return the function that weighs a step of `stepper`."""
    if isinstance(stepper, PaperStepper):
        return _PaperMotion(stepper)
    return _SpectralMotion(stepper.problem, threads)


@dataclass(frozen=True)
class _OnNodes:
    """What weighs shapes of so many nodes: fibers, their interaction, and threads."""

    fibers: tuple[SpectralFiber, ...]
    more: MoreNodes
    interaction: AbstractSpectralInteraction
    workers: Workers


class _SpectralMotion:
    """Weighs steps of the high-order engine."""

    def __init__(self, problem: Problem, threads: int | None) -> None:
        self._problem = problem
        self._threads = threads
        self._on = lru_cache(maxsize=4)(self._discretised)

    def __call__(self, carry: Carry) -> Balance | None:
        if carry.step == 0:
            return None
        on = self._on(carry.modes.shape[-1])
        fibers = on.fibers
        modes, pulls, t = carry.modes[:, 0], carry.tensions[:, 0], carry.time
        lengths = np.array([f.length for f in fibers])[:, None, None]
        unit = force_units(fibers)
        points = node_positions(fibers, modes)
        weights = np.stack([f.quadrature for f in fibers])
        elastic = unit * elastic_forces(fibers, modes, pulls)
        load = _load(self._problem, points, weights, t)
        force = np.ascontiguousarray((elastic - load) / unit)
        own = unit * resisted_forces(fibers, modes, force, on.workers)
        resisted = own
        if not on.interaction.alone:
            scene = on.interaction.scene(modes, t, on.workers)
            resisted = own + scene.velocity(unit * force, own)
        flow = self._problem.flow.velocity(points, t).transpose(0, 2, 1)
        drag = self._problem.drag
        motion = Motion(t, elastic, load, flow, flow - resisted / drag, weights)
        moving = _rate(carry)
        rate = lengths * np.matmul(moving, fibers[0].tables[0].T)
        # L x_ss and its rate
        bend, changing = (np.matmul(m, fibers[0].tables[2].T) for m in (modes, moving))
        stiffness = np.array([f.rigidity / f.length for f in fibers])[:, None, None]
        balance = motion.balance(rate, motion.power(stiffness * bend, changing / lengths))
        finer = on.more.resisted(modes, pulls, load)
        off = rate - motion.model + (finer - own) / drag
        tau = 1.0 / (balance.pace + 1.0 / t)
        return replace(balance, defect=motion.largest(on.more.lasting(off, tau)))

    def _discretised(self, nodes: int) -> _OnNodes:
        fibers, workers = spectral_fibers(self._problem, nodes), Workers(self._threads)
        more = MoreNodes(self._problem, fibers, workers)
        return _OnNodes(fibers, more, _interaction(self._problem, fibers), workers)


class _PaperMotion:
    """Weighs steps of the paper's engine: the mean of both ends against the change over it."""

    def __init__(self, stepper: PaperStepper) -> None:
        self._stepper = stepper

    def __call__(self, carry: PaperCarry) -> Balance | None:
        if carry.step == 0:
            return None
        t = self._stepper.time(carry)
        dt = t / carry.step
        before = carry.x_before, carry.tension_before, carry.slow_before
        ends = self._at(t - dt, *before), self._at(t, carry.x, carry.tension, slow=carry.slow)
        rate = (carry.x - carry.x_before) / dt
        change = (self._energy(carry.x) - self._energy(carry.x_before)) / dt
        one, other = (motion.balance(rate, change) for motion in ends)
        off = rate - 0.5 * (ends[0].model + ends[1].model)
        return Balance(
            t,
            change,
            dissipation=0.5 * (one.dissipation + other.dissipation),
            flow_power=0.5 * (one.flow_power + other.flow_power),
            load_power=0.5 * (one.load_power + other.load_power),
            defect=ends[1].largest(off),
            pace=other.pace,
            speed=other.speed,
        )

    def _at(self, t: float, x: Array, tension: Array, slow: Array) -> Motion:
        problem, fibers = self._stepper.problem, self._stepper.fibers
        shapes = [f.shape(own) for f, own in zip(fibers, x, strict=True)]
        parts = list(zip(fibers, shapes, strict=True))
        elastic = [f.elastic_force(s, q) for (f, s), q in zip(parts, tension, strict=True)]
        bending = np.stack([f.bending_velocity(s) for f, s in parts])
        points = np.ascontiguousarray(x.transpose(0, 2, 1))
        weights = np.stack([f.grid.weights for f in fibers])
        return Motion(
            t,
            np.stack(elastic),
            _load(problem, points, weights, t),
            problem.flow.velocity(points, t).transpose(0, 2, 1),
            (slow + bending) / problem.drag,
            weights,
        )

    def _energy(self, x: Array) -> float:
        """Return the elastic energy (49) of all fibers."""
        total = 0.0
        for fiber, own in zip(self._stepper.fibers, x, strict=True):
            bend = np.square(fiber.shape(own).xss).sum(axis=0)
            total += 0.5 * fiber.rigidity * float(bend @ fiber.grid.weights)
        return total


def _rate(carry: Carry) -> Array:
    """Return the rate of the position modes at the end of the last step, (fiber, 3, N)."""
    points = min(carry.known, int(carry.counters[1]) + _ONE_MORE)
    back = carry.time - carry.times[:points]
    weights = np.empty(points)
    for j in range(1, points):
        others = np.delete(back, [0, j])
        weights[j] = -np.prod(others / (others - back[j])) / back[j]
    weights[0] = -weights[1:].sum()  # a constant does not move
    return combined(weights, carry.modes)


def _load(problem: Problem, points: Array, weights: Array, t: float) -> Array:
    """Return the load per length at points (fiber, node, 3), as (fiber, 3, node)."""
    return np.ascontiguousarray(load_density(problem, points, weights, t).transpose(0, 2, 1))


def _interaction(
    problem: Problem, fibers: tuple[SpectralFiber, ...]
) -> AbstractSpectralInteraction:
    engine = problem.engine
    assert not isinstance(engine, PaperEngine)
    wanted = _SHARE * (engine.rtol or _FIXED_TOLERANCE)
    return spectral_interaction(problem, fibers, min(1e-2, max(1e-10, wanted)))
