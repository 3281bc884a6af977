"""The paper's time stepping (28)/(29): tension first, then positions by semi-implicit BDF2.

    8 pi mu (3 x^{n+1} - 4 x^n + x^{n-1}) / (2 dt)
        = -(Lambda + K)*[E x_ssss^{n+1}] + 2 G(x^n) - G(x^{n-1}),
    G(x) = 8 pi mu U_0 + (Lambda + K)[(T x_s)_s],

with Lambda and K at the extrapolated shape x* = 2 x^n - x^{n-1}. The first step is Euler's. The
equation holds at nodes 2 ... N - 2; the rows of nodes 0, 1, N - 1, N carry the free-end conditions.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from time import perf_counter

import numpy as np

from stokesfibers.constraint.line_tension import solve_tension
from stokesfibers.core.arrays import Array, Nodal, Positions, as_float
from stokesfibers.core.errors import InputError
from stokesfibers.problem.problem import Problem
from stokesfibers.slender.discrete import DiscreteFiber, Shape
from stokesfibers.stepping.report import StepReport


@dataclass(frozen=True)
class Carry:
    """Everything the next step needs; arrays of shape (fiber, 3, node) but for the tension.

    Attributes
    ----------
    step
        Number of steps taken.
    x, x_before
        Positions now and one step before.
    tension
        Line tension now, (fiber, node).
    slow, slow_before
        G(x) of the scheme now and one step before.
    """

    step: int
    x: Array
    x_before: Array
    tension: Nodal
    slow: Array
    slow_before: Array

    @classmethod
    def restored(cls, step: int, arrays: Mapping[str, Array]) -> Carry:
        """Return the carry of `step` from the arrays of a checkpoint."""
        return cls(step=step, **arrays)

    def arrays(self) -> dict[str, Array]:
        """Return all arrays by name, for a checkpoint."""
        return {f.name: getattr(self, f.name) for f in fields(self) if f.name != "step"}

    @property
    def positions(self) -> Positions:
        """Positions as (fiber, node, space)."""
        return np.ascontiguousarray(self.x.transpose(0, 2, 1))


class PaperStepper:
    """Advances a problem by the paper's scheme with a fixed step.

    Parameters
    ----------
    problem
        The case; its engine must be a `PaperEngine`.
    """

    def __init__(self, problem: Problem) -> None:
        engine = problem.engine
        assert engine.dt is not None
        assert engine.beta is not None
        self._problem = problem
        self._dt = engine.dt
        self._beta = engine.beta
        self._drag = problem.drag
        kinds = {
            kind: DiscreteFiber.build(
                kind.length,
                kind.eps,
                rigidity=kind.rigidity,
                intervals=engine.intervals,
                mobility=problem.mobility,
            )
            for kind in problem.fibers
        }
        self.fibers: tuple[DiscreteFiber, ...] = tuple(kinds[k] for k in problem.fibers)

    def time(self, step: int) -> float:
        """Return the time after `step` steps."""
        return step * self._dt

    def init(self, positions: Positions) -> Carry:
        """Return the carry at time 0 from positions (fiber, node, space)."""
        expected = (len(self.fibers), self._problem.engine.intervals + 1, 3)
        if positions.shape != expected:
            raise InputError("positions", f"shape {expected}", positions.shape)
        x = np.ascontiguousarray(positions.transpose(0, 2, 1))
        tension, slow = self._tension_and_slow(x, 0.0)
        return Carry(0, x, x, tension, slow, slow)

    def step(self, carry: Carry) -> tuple[Carry, StepReport]:
        """Return the carry one step later and a report.

        Raises
        ------
        numpy.linalg.LinAlgError
            If a system is singular.
        """
        started = perf_counter()
        first = carry.step == 0
        # x = (4 x^n - x^{n-1}) / 3 + (2 dt / 3) x_t, or Euler's x = x^n + dt x_t
        reach = self._dt if first else 2.0 * self._dt / 3.0
        known = carry.x if first else (4.0 * carry.x - carry.x_before) / 3.0
        ahead = carry.x if first else 2.0 * carry.x - carry.x_before
        slow = carry.slow if first else 2.0 * carry.slow - carry.slow_before
        factor = reach / self._drag
        right = known + factor * slow
        x = np.empty_like(carry.x)
        for k, fiber in enumerate(self.fibers):
            x[k] = _solve_positions(fiber, fiber.shape(ahead[k]), factor, right[k])
        moved = perf_counter()
        t = self.time(carry.step + 1)
        tension, slow = self._tension_and_slow(x, t)
        wall_time = (moved - started, perf_counter() - moved)
        report = StepReport(t, self._dt, 1 if first else 2, wall_time)
        return Carry(carry.step + 1, x, carry.x, tension, slow, carry.slow), report

    def _tension_and_slow(self, x: Array, t: float) -> tuple[Nodal, Array]:
        """Return the tension (22) and G for positions (fiber, 3, node) at time t."""
        flow = self._problem.flow
        points = x.transpose(0, 2, 1)
        velocity = flow.velocity(points, t).transpose(0, 2, 1)
        gradient = flow.gradient(points, t)
        tension, slow = np.empty((x.shape[0], x.shape[2])), np.empty_like(x)
        for k, fiber in enumerate(self.fibers):
            shape = fiber.shape(x[k])
            stretching = _stretching(shape, gradient[k])
            tension[k] = solve_tension(fiber, shape, stretching, drag=self._drag, beta=self._beta)
            slow[k] = self._drag * velocity[k] + fiber.tensile_velocity(shape, tension[k])
        return tension, slow


def _stretching(shape: Shape, gradient: Array) -> Array:
    """Return x_s . dU_0/ds = x_s . (grad U_0) x_s at the nodes; gradient (node, 3, 3)."""
    return np.einsum("in,nij,jn->n", shape.xs, gradient, shape.xs)


def _solve_positions(fiber: DiscreteFiber, ahead: Shape, factor: float, right: Array) -> Array:
    """Solve the implicit system of one fiber; `right` (3, node) is given at all nodes."""
    matrix = fiber.evolution_matrix(ahead, factor)
    rows = right.copy()
    rows[:, [0, 1, -2, -1]] = 0.0  # free ends: homogeneous conditions
    return as_float(np.linalg.solve(matrix, rows.ravel()).reshape(3, -1))
