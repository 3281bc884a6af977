"""Linearly implicit difference formulas of order 1 to 5 for positions and tensions together, (20).

With x and T extrapolated to the new time, (x*, T*), one linear system is solved for both:

    8 pi mu (x_t - U) = -M* (f - g),   f = E x_ssss - [T* x_s + (T - T*) x*_s]_s,
    x*_s . x_s = (1 + |x*_s|^2) / 2,

where x_t is the backward difference formula, U is linearised about x*, and M* at x* is Lambda +
K_delta and, with an interaction, the velocities by all other fibers (`spectral_solve`). Then
``|x_s|^2 - 1 = |x_s - x*_s|^2``: the length errs by the square of a step's error and does not
drift. More Newton passes repeat the step about its own result. Steps depend on the carry alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from stokesfibers.core.arrays import Array, Points, Positions
from stokesfibers.core.errors import InputError
from stokesfibers.core.parallel import Workers
from stokesfibers.core.team import ALONE, AbstractTeam
from stokesfibers.flow import AbstractFlow
from stokesfibers.kernels import spectral as kernels
from stokesfibers.numerics import bdf
from stokesfibers.numerics.step_control import AbstractStepControl
from stokesfibers.slender.spectral import SpectralFiber
from stokesfibers.slender.spectral_forces import (
    elastic_forces,
    force_units,
    node_positions,
    resisted_forces,
)
from stokesfibers.slender.spectral_interaction import AbstractSpectralInteraction, Summed
from stokesfibers.stepping.base import StepError
from stokesfibers.stepping.report import StepReport
from stokesfibers.stepping.spectral_carry import DEPTH, Carry, State, combined, pushed
from stokesfibers.stepping.spectral_system import FibersInFluid, Pass, Surroundings
from stokesfibers.stepping.spectral_team import solver_for

_NOISE = 1e-15  # rounding of positions: what the bend is measured against at least
_STRAIGHT = 1e-9  # a bend, over the length, below which a fiber counts as straight
_SHARE = 0.2  # error allowed to positions, over that allowed to the relative bend
_MOST_TRIES = 40
_START_REDUCTION = 1e-10
_EULER_MODE = 500.6  # 4.73^4: slowest bending rate of a free rod
_RIGID = 10.0  # effective viscosity (10) far below buckling, of a fiber among much softer ones
_STIFFER = 1e-2  # at most this much of the softest one's

Load = Callable[[Positions, float], Positions]
"""External force per length at positions (fiber, node, space) and a time."""


@dataclass(frozen=True)
class _Try:
    """A solved step before it is judged."""

    state: State
    offsets: list[float]
    predictors: list[list[float]]
    ratio: Array
    iterations: int
    summed: Summed
    solved: float


class SpectralStepper:
    """Advances fibers, each alone in the flow (20) or interacting, by formulas of order 1 to 5.

    Parameters
    ----------
    fibers
        The discretised fibers, all with the same number of nodes.
    drag
        8 pi mu.
    flow
        Background flow.
    control
        `AdaptiveSteps` or `FixedSteps`.
    newton_passes
        1 for the linearly implicit step; 2 brings the length error to rounding.
    load
        External force per length; None for none. It is taken at the extrapolated positions.
    interaction
        How the fibers act on each other; None for each alone.
    threads
        Threads that fibers are spread over; None for all cores. Results do not depend on it.
    team
        Ranks that solve together; this is rank 0, the others `assist`.
    """

    def __init__(
        self,
        fibers: tuple[SpectralFiber, ...],
        *,
        drag: float,
        flow: AbstractFlow,
        control: AbstractStepControl,
        newton_passes: int = 1,
        load: Load | None = None,
        interaction: AbstractSpectralInteraction | None = None,
        threads: int | None = None,
        team: AbstractTeam = ALONE,
    ) -> None:
        if not fibers or len({f.count for f in fibers}) > 1:
            raise InputError("fibers", "one fiber or more, all with as many nodes", len(fibers))
        if newton_passes < 1:
            raise InputError("newton_passes", "1 or more", newton_passes)
        self.fibers = fibers
        self.flow = flow
        self.control = control
        self._drag = drag
        self._passes = newton_passes
        self._load = load
        self._workers = Workers(threads, team)
        self._solver = solver_for(FibersInFluid(fibers, drag, interaction), self._workers)
        self._lengths = np.array([f.length for f in fibers])[:, None, None]
        self._drags = [f.drag_number(drag) for f in fibers]
        softest, rate = max(self._drags), flow.rate_scale()
        # a bend that never grows need not be known better than the position
        self._rigid = [d * rate < _RIGID and d < _STIFFER * softest for d in self._drags]
        self._least_bends = np.where(self._rigid, _SHARE, _STRAIGHT)

    def init(self, positions: tuple[Callable[[Array], Points], ...]) -> Carry:
        """Return the carry at time 0 from one function per fiber: fractions (n,) to points (n, 3).

        The tension is that of the constraint at rest: no stretching at the initial velocity.
        """
        if len(positions) != len(self.fibers):
            raise InputError("positions", f"{len(self.fibers)} curves", len(positions))
        modes = np.stack([f.fit(p) for f, p in zip(self.fibers, positions, strict=True)])
        count, n = len(self.fibers), self.fibers[0].count
        rest = State(modes, np.zeros((count, n - 1)))
        around = self._surroundings(modes, 0.0)
        start = self._solver.solve(rest, 0.0 * modes, around, Pass(1.0, 0.0, _START_REDUCTION))
        history = np.zeros((count, DEPTH, 3, n))
        pulls = np.zeros((count, DEPTH, n - 1))
        history[:, 0], pulls[:, 0] = modes, start.tensions
        return Carry(
            step=0,
            times=np.zeros(DEPTH),
            modes=history,
            tensions=pulls,
            next_size=np.array([self.control.first(self._rate(start.modes))]),
            counters=np.array([1, 0, 1, 0, 0]),
            ratio=start.ratio,
        )

    def step(self, carry: Carry) -> tuple[Carry, StepReport]:
        """Return the carry one step later and a report.

        Raises
        ------
        StepError
            If no try succeeds.
        """
        started = perf_counter()
        order, _, known, settled, rejected = (int(c) for c in carry.counters)
        size, solving = float(carry.next_size[0]), 0.0
        for tries in range(_MOST_TRIES):
            if carry.time + size == carry.time:
                break
            tried, errors = self._attempt(carry, size, order)
            verdict = self.control.judge(errors, size, order, 0 if tries else settled)
            if tried is None:
                size = verdict.size
                continue
            solving += tried.solved
            if verdict.accepted:
                settled = settled + 1 if verdict.order == order and not tries else 0
                state = min(DEPTH, known + 1), settled, rejected + tries
                ahead = Carry(
                    step=carry.step + 1,
                    times=np.concatenate([[carry.time + size], carry.times[:-1]]),
                    modes=pushed(tried.state.modes, carry.modes),
                    tensions=pushed(tried.state.tensions, carry.tensions),
                    next_size=np.array([verdict.size]),
                    counters=np.array([verdict.order, order, *state]),
                    ratio=tried.ratio,
                )
                wall_time = (solving, perf_counter() - started - solving)
                return ahead, StepReport(
                    ahead.time,
                    size,
                    order,
                    wall_time,
                    tries,
                    tried.iterations,
                    **vars(tried.summed),
                )
            size = verdict.size
        raise StepError(
            f"No step from t = {carry.time:.6g} succeeds, however short",
            "Take more discretization.nodes, or a smaller stepping.rtol or dt",
        )

    def interpolate(self, carry: Carry, t: float) -> State:
        """Return the state at a time `t` within the last step.

        The polynomial goes through one state more than the formula's own: lengths between steps
        then err no more than at them.

        Raises
        ------
        InputError
            If `t` lies outside the last step.
        """
        first, last = (carry.time, carry.time) if carry.step == 0 else carry.times[1::-1]
        if not first <= t <= last:
            raise InputError("t", f"a time from {first:.17g} to {last:.17g}", t)
        if t == last:
            return State(carry.modes[:, 0], carry.tensions[:, 0])
        points = min(carry.known, int(carry.counters[1]) + 2)
        offsets = [last - back for back in carry.times[:points].tolist()]
        weights = np.array(bdf.value_weights(offsets, last - t))
        return State(combined(weights, carry.modes), combined(weights, carry.tensions))

    def velocity(self, state: State, t: float) -> Array:
        """Return x_t of the model at the nodes for given positions and tensions, (fiber, 3, N)."""
        around, unit = self._surroundings(state.modes, t), force_units(self.fibers)
        force = elastic_forces(self.fibers, state.modes, state.tensions) - around.load
        resisted = resisted_forces(self.fibers, state.modes, force, self._workers)
        resisted += self._solver.others(state, t, force, resisted)
        return self._lengths * around.flow - unit * resisted / self._drag

    def _rate(self, velocity: Array) -> float:
        """Return a rate of change from the initial velocity modes, or from the bending rates."""
        fastest = 0.0
        for k, fiber in enumerate(self.fibers):
            fastest = max(fastest, float(np.abs(velocity[k] @ fiber.tables[0].T).max()))
            if not self._rigid[k]:
                bending = _EULER_MODE * (fiber.local.a + fiber.local.b) / self._drags[k]
                fastest = max(fastest, bending)
        return fastest

    def _attempt(self, carry: Carry, size: float, order: int) -> tuple[_Try | None, dict]:
        """Return a step of `size` and `order` with its errors by order; None if it failed."""
        wanted = self.control.orders(order, carry.known)
        t = carry.time + size
        offsets = [t - back for back in carry.times[: carry.known].tolist()]
        predictors = bdf.extrapolations(offsets)
        if carry.known > order:
            value = predictors[order]
            rate = bdf.predicted_rate_weights(order, offsets, predictors)
        else:  # the first step starts from the state itself
            value, rate = [1.0], [0.0]
        alpha = bdf.leading_coefficient(order, offsets)
        guess = State(combined(value, carry.modes), combined(value, carry.tensions))
        moving = combined(rate, carry.modes)
        solving = perf_counter()
        ratio, iterations, summed = carry.ratio, 0, Summed()
        try:
            for _ in range(self._passes):
                around = self._surroundings(guess.modes, t)
                found = self._solver.solve(guess, moving, around, Pass(alpha))
                guess = State(guess.modes + found.modes, guess.tensions + found.tensions)
                moving = moving + alpha * found.modes
                ratio, iterations = found.ratio, iterations + found.iterations
                summed = found.summed
        except np.linalg.LinAlgError:  # not finite, or singular
            return None, dict.fromkeys((order,), float("inf"))
        solving = perf_counter() - solving
        tried = _Try(guess, offsets, predictors, ratio, iterations, summed, solving)
        return tried, self._errors(carry, tried, wanted)

    def _errors(self, carry: Carry, tried: _Try, orders: tuple[int, ...]) -> dict[int, float]:
        """Return the local errors by order, in units of what a step may commit."""
        if not orders:
            return {}
        weights = np.zeros((len(orders), DEPTH))
        scales = np.empty(len(orders))
        for r, q in enumerate(orders):
            weights[r, : q + 1] = tried.predictors[q]
            scales[r] = bdf.error_factor(q, tried.offsets)
        bend = self.control.step_tolerance
        errors = kernels.step_errors(
            weights,
            scales,
            carry.modes,
            tried.state.modes,
            self.fibers[0].tables[0],
            (_SHARE * bend, bend, _NOISE),
            self._least_bends,
        )
        return dict(zip(orders, errors.tolist(), strict=True))

    def _surroundings(self, modes: Array, t: float) -> Surroundings:
        """Return flow and load at the nodes."""
        points = node_positions(self.fibers, modes)
        flow = (self.flow.velocity(points, t) / self._lengths).transpose(0, 2, 1)
        gradient = np.ascontiguousarray(self.flow.gradient(points, t))
        load = np.zeros(modes.shape)
        if self._load is not None:
            units = np.array([f.length**3 / f.rigidity for f in self.fibers])[:, None, None]
            load = np.ascontiguousarray((units * self._load(points, t)).transpose(0, 2, 1))
        return Surroundings(t, np.ascontiguousarray(flow), gradient, load)
