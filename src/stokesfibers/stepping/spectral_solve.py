"""The linear system of one implicit step: each fiber's own, and all of them coupled, (6).

With y the increments of modes and tensions of all fibers, the coupled system is

    A y + C (f* + D y) = r.

A holds each fiber's own equations, f* + D y is the force per length, and C the velocities between
fibers at the extrapolated positions, at their nodes. It is solved for the change ``u = C D y`` of
these velocities:

    (I + C D A^-1) u = C D y_0,    y_0 = A^-1 (r - C f*),    y = y_0 - A^-1 u,

by GMRES: y_0 is the step with the forces that others exert extrapolated. What remains of u is
amplified like the extrapolation of tensions, by at most 2^5 - 1 from step to step at order 5: a
reduction well below 1/31 keeps the coupling as stable as if it were solved exactly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import get_lapack_funcs

from stokesfibers.core.arrays import Array
from stokesfibers.core.parallel import Workers
from stokesfibers.kernels import spectral as kernels
from stokesfibers.numerics.krylov import gmres
from stokesfibers.slender.spectral import SpectralFiber
from stokesfibers.slender.spectral_suspension import SpectralInteraction, SpectralScene
from stokesfibers.stepping.spectral_carry import State

_factored, _solved = get_lapack_funcs(("getrf", "getrs"), dtype=np.float64)

REDUCTION = 1e-3
"""Of the residual of the coupled system in a step."""
_MOST_ITERATIONS = 60


@dataclass(frozen=True)
class Surroundings:
    """What acts on the fibers at their nodes, in units of their own length and rigidity.

    Attributes
    ----------
    flow
        U / L, (fiber, 3, N).
    gradient
        grad U, (fiber, N, 3, 3).
    load
        External force per length times L^3 / E, (fiber, 3, N).
    """

    flow: Array
    gradient: Array
    load: Array


@dataclass(frozen=True)
class Increment:
    """Change of a state by one Newton pass.

    Attributes
    ----------
    modes, tensions
        As in `State`.
    ratio
        Largest ratio of the kernel's series, (fiber,).
    iterations
        Of the coupled solve; 1 if there is nothing to couple.
    """

    modes: Array
    tensions: Array
    ratio: Array
    iterations: int


class _Systems:
    """The assembled and factored equations of all fibers about one state."""

    def __init__(self, count: int, nodes: int) -> None:
        m = nodes - 1
        self.right = np.empty((count, 4 * nodes - 1))
        self.scale, self.ratio = np.empty(count), np.empty(count)
        self.force, self.resisted = np.empty((count, 3, nodes)), np.empty((count, 3, nodes))
        self.mobility = np.empty((count, 6, nodes, nodes))
        self.own = np.empty((count, nodes, nodes))
        self.tangent, self.curvature = np.empty_like(self.force), np.empty_like(self.force)
        self.factors = [(np.empty(0), np.empty(0))] * count
        self._nodes, self._tension_modes = nodes, m

    def solve(self, right: Array) -> Array:
        """Return A^-1 right, both (fiber, 4 N - 1)."""
        out = np.empty_like(right)
        for k, (lu, pivots) in enumerate(self.factors):
            # the matrix was factored as its transpose, which is how LAPACK reads C order
            out[k], _ = _solved(lu, pivots, right[k], trans=1)
        return out

    def split(self, found: Array) -> tuple[Array, Array]:
        """Return modes (fiber, 3, N) and tensions (fiber, N - 1) of a solution."""
        rows = 3 * self._nodes
        modes = found[:, :rows].reshape(-1, 3, self._nodes)
        return modes, found[:, rows:] / self.scale[:, None]


class IncrementSolver:
    """Solves for the increments of one Newton pass.

    Parameters
    ----------
    fibers
        The discretised fibers.
    drag
        8 pi mu.
    interaction
        How they act on each other; None for each alone.
    workers
        Threads.
    """

    def __init__(
        self,
        fibers: tuple[SpectralFiber, ...],
        drag: float,
        *,
        interaction: SpectralInteraction | None,
        workers: Workers,
    ) -> None:
        self._fibers = fibers
        self._workers = workers
        self._interaction = None if interaction is None or interaction.alone else interaction
        self._tables = [f.kernel_tables for f in fibers]
        self._drags = [f.drag_number(drag) for f in fibers]
        self._unit = np.array([f.rigidity / f.length**3 for f in fibers])[:, None, None]

    def solve(
        self,
        state: State,
        rate: Array,
        around: Surroundings,
        *,
        alpha: float,
        implicit: float,
        reduction: float = REDUCTION,
    ) -> Increment:
        """Return the increments about `state`; see `kernels.increment_system`.

        Raises
        ------
        numpy.linalg.LinAlgError
            If the system is singular or not finite, or GMRES does not reach `reduction`.
        """
        systems = self._assembled(state, rate, around, (alpha, implicit))
        if self._interaction is None:
            found, iterations = systems.solve(systems.right), 1
        else:
            scene = SpectralScene(self._interaction, state.modes, self._workers)
            found, iterations = self._coupled(systems, scene, reduction)
        if not np.isfinite(found).all():
            raise np.linalg.LinAlgError("the step is not finite")
        return Increment(*systems.split(found), systems.ratio, iterations)

    def others(self, modes: Array, force: Array, resisted: Array) -> Array:
        """Return what others add to M f at the nodes, (fiber, 3, N), in units of E / L^3."""
        if self._interaction is None:
            return np.zeros_like(force)
        scene = SpectralScene(self._interaction, modes, self._workers)
        return scene.velocity(self._unit * force, self._unit * resisted) / self._unit

    def _assembled(
        self, state: State, rate: Array, around: Surroundings, pace: tuple[float, float]
    ) -> _Systems:
        count = len(self._fibers)
        systems = _Systems(count, self._fibers[0].count)

        def one(k: int) -> None:
            matrix, systems.right[k], systems.scale[k], systems.ratio[k], *about = (
                kernels.increment_system(
                    state.modes[k],
                    state.tensions[k],
                    rate[k],
                    around.flow[k],
                    around.gradient[k],
                    around.load[k],
                    *pace,
                    self._drags[k],
                    *self._tables[k],
                )
            )
            systems.force[k], systems.resisted[k], systems.mobility[k] = about[:3]
            systems.own[k], systems.tangent[k], systems.curvature[k] = about[3:]
            lu, pivots, info = _factored(matrix.T, overwrite_a=True)
            if info > 0:
                raise np.linalg.LinAlgError("the equations of a fiber are singular")
            systems.factors[k] = lu, pivots

        self._workers.for_each(count, one)
        return systems

    def _coupled(
        self, systems: _Systems, scene: SpectralScene, reduction: float
    ) -> tuple[Array, int]:
        """Return the solution of the coupled system and the iterations."""
        table, slopes = self._fibers[0].tension_tables
        shift = systems.scale[:, None, None] / self._unit
        rows = 3 * systems.own.shape[1]

        def velocity(force: Array, resisted: Array) -> Array:
            return shift * scene.velocity(self._unit * force, self._unit * resisted)

        def by_force(found: Array) -> Array:
            """C D: the velocities that the increments bring about."""
            modes, tensions = systems.split(found)
            force = np.matmul(modes, systems.own.transpose(0, 2, 1))
            force -= (tensions @ table.T)[:, None] * systems.curvature
            force -= (tensions @ slopes.T)[:, None] * systems.tangent
            resisted = np.empty_like(force)
            for k, f in enumerate(force):
                resisted[k] = kernels.resisted_force(systems.mobility[k], f)
            return velocity(force, resisted)

        def own(u: Array) -> Array:
            right = np.zeros_like(systems.right)
            right[:, :rows] = u.reshape(len(u), -1)
            return systems.solve(right)

        def operator(u: Array) -> tuple[Array, Array]:
            answer = own(u)
            return u + by_force(answer), answer

        first = systems.solve(systems.right) - own(velocity(systems.force, systems.resisted))
        right = by_force(first)
        change, iterations = gmres(operator, right, reduction=reduction, most=_MOST_ITERATIONS)
        return first - change, iterations
