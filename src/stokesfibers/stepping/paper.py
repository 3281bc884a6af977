"""The paper's time stepping (28)/(29): tension first, then positions by semi-implicit BDF2.

    8 pi mu (3 x^{n+1} - 4 x^n + x^{n-1}) / (2 dt)
        = -(Lambda + K)*[E x_ssss^{n+1}] + 2 G(x^n) - G(x^{n-1}),
    G(x) = 8 pi mu U_0 + (Lambda + K)[(T x_s)_s] - sum over the others of V + (eps L)^2/2 W,

with Lambda and K at the extrapolated shape x* = 2 x^n - x^{n-1}. The first step is Euler's. The
equation holds at nodes 2 ... N - 2; the rows of nodes 0, 1, N - 1, N carry the free-end conditions.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from time import perf_counter
from typing import ClassVar

import numpy as np

from stokesfibers.constraint.line_tension import solve_tension
from stokesfibers.constraint.suspension import own_systems, solve_coupled
from stokesfibers.core.arrays import Array, Nodal, Positions
from stokesfibers.core.errors import InputError
from stokesfibers.core.parallel import Workers
from stokesfibers.fiber.curves import Curve
from stokesfibers.kernels import dense
from stokesfibers.problem.discretised import discrete_fibers, load_density
from stokesfibers.problem.engine import PaperEngine
from stokesfibers.problem.problem import Problem
from stokesfibers.slender.discrete import DiscreteFiber
from stokesfibers.slender.sampled import Shape, View
from stokesfibers.slender.suspension import Interaction, Scene
from stokesfibers.stepping.base import AbstractStepper
from stokesfibers.stepping.report import StepReport

_ROUNDING = 1e-9  # of a step: an end that falls on a step must not ask for one more


@dataclass(frozen=True)
class Carry:
    """Everything the next step needs; arrays of shape (fiber, 3, node) but for the tension.

    Attributes
    ----------
    step
        Number of steps taken.
    x, x_before
        Positions now and one step before.
    tension, tension_before
        Line tension now and one step before, (fiber, node).
    slow, slow_before
        G(x) of the scheme now and one step before.
    """

    step: int
    x: Array
    x_before: Array
    tension: Nodal
    tension_before: Nodal
    slow: Array
    slow_before: Array

    def arrays(self) -> dict[str, Array]:
        """Return all arrays by name, for a checkpoint."""
        return {f.name: getattr(self, f.name) for f in fields(self) if f.name != "step"}

    @property
    def positions(self) -> Positions:
        """Positions as (fiber, node, space)."""
        return np.ascontiguousarray(self.x.transpose(0, 2, 1))


class PaperStepper(AbstractStepper[Carry]):
    """Advances a problem by the paper's scheme with a fixed step.

    Parameters
    ----------
    problem
        The case; its engine must be a `PaperEngine`.
    threads
        Threads that fibers are spread over; None for all cores. Results do not depend on it.
    """

    dense: ClassVar[bool] = False
    stages: ClassVar[tuple[str, str]] = ("positions", "tension")

    def __init__(self, problem: Problem, threads: int | None = None) -> None:
        engine = problem.engine
        assert isinstance(engine, PaperEngine)
        assert engine.dt is not None
        assert engine.beta is not None
        self.problem = problem
        self._dt = engine.dt
        self._beta = engine.beta
        self._drag = problem.drag
        self.fibers: tuple[DiscreteFiber, ...] = discrete_fibers(problem, engine.intervals)
        self._workers = Workers(threads)
        self._interaction = Interaction.build(
            self.fibers,
            problem.domain,
            image_sum=problem.image_sum,
            close_approach=problem.close_approach,
        )
        count, inner = len(self.fibers), engine.intervals - 1
        shape = (0,) if self._interaction.alone else (count, inner, count, inner)
        self._buffer = np.empty(shape)  # written anew in each step, carries nothing over

    def time(self, carry: Carry) -> float:
        return carry.step * self._dt

    def reached(self, carry: Carry, until: float) -> bool:
        return carry.step >= until / self._dt - _ROUNDING

    def view(self, carry: Carry, t: float) -> View:  # noqa: ARG002
        shapes = tuple(f.shape(x) for f, x in zip(self.fibers, carry.x, strict=True))
        return View(self.time(carry), self.fibers, shapes, carry.tension)

    def length_error(self, carry: Carry) -> float:
        """Return the largest relative error of the polygons' lengths; infinite if not finite."""
        chords = np.linalg.norm(np.diff(carry.x, axis=2), axis=1).sum(axis=1)
        lengths = np.array([f.grid.length for f in self.fibers])
        error = float(np.max(np.abs(chords - lengths) / lengths))
        return error if np.isfinite(error) and np.isfinite(carry.slow).all() else np.inf

    def restored(self, step: int, arrays: Mapping[str, Array]) -> Carry:
        shape = arrays["x"].shape if "x" in arrays else ()
        expected = (len(self.fibers), 3, self.fibers[0].grid.intervals + 1)
        if shape != expected:
            raise InputError("problem", f"the problem of the run, with positions {shape}", expected)
        return Carry(step=step, **arrays)

    def start(self, curves: tuple[Curve, ...]) -> Carry:
        sigma = np.linspace(0.0, 1.0, self.fibers[0].grid.intervals + 1)
        return self.init(np.stack([curve.at_fractions(sigma) for curve in curves]))

    def init(self, positions: Positions) -> Carry:
        """Return the carry at time 0 from positions (fiber, node, space)."""
        expected = (len(self.fibers), self.fibers[0].grid.intervals + 1, 3)
        if positions.shape != expected:
            raise InputError("positions", f"shape {expected}", positions.shape)
        x = np.ascontiguousarray(positions.transpose(0, 2, 1))
        guess = np.zeros((x.shape[0], x.shape[2]))
        tension, slow, _ = self._tension_and_slow(x, 0.0, guess)
        return Carry(0, x, x, tension, tension, slow, slow)

    def step(self, carry: Carry) -> tuple[Carry, StepReport]:
        """Return the carry one step later and a report: (25) by the split (28) and by (29).

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

        def move(k: int) -> None:
            fiber = self.fibers[k]
            x[k] = _solve_positions(fiber, fiber.shape(ahead[k]), factor, right[k])

        self._workers.for_each(len(self.fibers), move)
        moved = perf_counter()
        t = (carry.step + 1) * self._dt
        guess = 2.0 * carry.tension - carry.tension_before
        tension, slow, iterations = self._tension_and_slow(x, t, guess)
        wall_time = (moved - started, perf_counter() - moved)
        order = 1 if first else 2
        nodes = self.fibers[0].grid.intervals + 1
        report = StepReport(t, self._dt, order, wall_time, iterations=iterations, nodes=nodes)
        after = Carry(carry.step + 1, x, carry.x, tension, carry.tension, slow, carry.slow)
        return after, report

    def _tension_and_slow(self, x: Array, t: float, guess: Nodal) -> tuple[Nodal, Array, int]:
        """Return tension (27), G and iterations for positions (fiber, 3, node) at time t."""
        flow = self.problem.flow
        points = x.transpose(0, 2, 1)
        velocity = flow.velocity(points, t).transpose(0, 2, 1)
        gradient = flow.gradient(points, t)
        shapes = tuple(f.shape(x[k]) for k, f in enumerate(self.fibers))
        stretching = np.stack([_stretching(s, g) for s, g in zip(shapes, gradient, strict=True)])
        slow = self._drag * velocity
        scene = Scene(self._interaction, shapes, self._workers)
        density = self._load_density(x, t)
        if density.any():
            pushed, stretched = scene.loaded(density)
            slow = slow + pushed
            stretching[:, 1:-1] += stretched[:, 1:-1] / self._drag
        if self._interaction.alone:
            drag, beta, iterations = self._drag, self._beta, 1
            parts = zip(self.fibers, shapes, stretching, strict=True)
            tension = np.stack([solve_tension(*p, drag=drag, beta=beta) for p in parts])
            slow = slow - self._own_centreline(shapes, tension)
        else:
            own, right = own_systems(
                self.fibers,
                shapes,
                stretching,
                drag=self._drag,
                beta=self._beta,
                workers=self._workers,
            )
            solver = self.problem.tension_solver
            tension, iterations = solve_coupled(
                scene, own, right, start=guess, solver=solver, buffer=self._buffer
            )
            tensile = scene.tensile_value(tension)
            centreline = tensile + scene.bending_value
            others = scene.at_nodes(scene.integrated_force(tension), centreline)
            slow = slow - tensile - others
        return tension, np.ascontiguousarray(slow), iterations

    def _load_density(self, x: Array, t: float) -> Array:
        """Return the external force per length, (fiber, 3, node)."""
        positions = np.ascontiguousarray(x.transpose(0, 2, 1))
        weights = np.stack([f.grid.weights for f in self.fibers])
        density = load_density(self.problem, positions, weights, t)
        return np.ascontiguousarray(density.transpose(0, 2, 1))

    def _own_centreline(self, shapes: tuple[Shape, ...], tension: Nodal) -> Array:
        """Return -(Lambda + K)[(T x_s)_s] of each fiber, (fiber, 3, node)."""
        return np.stack(
            [
                -f.tensile_velocity(s, q)
                for f, s, q in zip(self.fibers, shapes, tension, strict=True)
            ]
        )


def _stretching(shape: Shape, gradient: Array) -> Array:
    """Return x_s . dU_0/ds = x_s . (grad U_0) x_s at the nodes; gradient (node, 3, 3)."""
    return np.einsum("in,nij,jn->n", shape.xs, gradient, shape.xs)


def _solve_positions(fiber: DiscreteFiber, ahead: Shape, factor: float, right: Array) -> Array:
    """Solve the implicit system of one fiber; `right` (3, node) is given at all nodes."""
    matrix = fiber.evolution_matrix(ahead, factor)
    rows = right.copy()
    rows[:, [0, 1, -2, -1]] = 0.0  # free ends: homogeneous conditions
    return dense.solve(matrix, rows.ravel()).reshape(3, -1)
