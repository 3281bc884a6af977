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

Each rank assembles, factors and solves its share of the fibers. Forces and velocities are brought
together in each application of the coupled operator, and all ranks iterate on the same numbers.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import get_lapack_funcs

from stokesfibers.core.arrays import Array
from stokesfibers.core.parallel import Workers
from stokesfibers.kernels import spectral as kernels
from stokesfibers.numerics.krylov import gmres
from stokesfibers.slender.spectral_forces import force_units
from stokesfibers.slender.spectral_interaction import AbstractSpectralScene, Summed
from stokesfibers.stepping.spectral_carry import State
from stokesfibers.stepping.spectral_system import FibersInFluid, Increment, Pass, Surroundings

_factored, _solved = get_lapack_funcs(("getrf", "getrs"), dtype=np.float64)

_FEWEST_ITERATIONS, _MOST_ITERATIONS = 60, 300
"""Before a step is given up and halved: fibers near contact want some 150, and there a step that is
halved wants as many again."""
_BASIS = 10_000_000  # numbers that iterations beyond the fewest may hold
_BLOCK = 16  # fibers whose solves are one task


class _Systems:
    """The assembled and factored equations of this rank's share of the fibers about one state.

    The first axis of all arrays is the share but for `scale` and `ratio`, which are of all fibers.
    What `others` need, forces and what increments do to them, is held if there are any.
    """

    def __init__(self, count: int, nodes: int, workers: Workers, *, others: bool) -> None:
        self._workers = workers
        self.share = workers.team.share(count)
        own = len(self.share)
        self.right = np.empty((own, 4 * nodes - 1))
        self.scale, self.ratio = np.empty(count), np.empty(count)
        told = own if others else 0
        self.force, self.resisted = np.empty((told, 3, nodes)), np.empty((told, 3, nodes))
        self.mobility = np.empty((told, 6, nodes, nodes))
        self.own = np.empty((told, nodes, nodes))
        self.tangent, self.curvature = np.empty_like(self.force), np.empty_like(self.force)
        self.factors = [(np.empty(0), np.empty(0))] * own
        self._nodes = nodes

    @property
    def rows(self) -> slice:
        """The share as a slice of arrays of all fibers."""
        return slice(self.share.start, self.share.stop)

    def together(self, rows: Array) -> Array:
        """Return an array of all fibers from each rank's share of it."""
        if self._workers.team.size == 1:
            return rows
        out = np.empty((len(self.scale), *rows.shape[1:]))
        out[self.rows] = rows
        self._workers.team.complete(out)
        return out

    def tell(self, i: int, about: tuple[Array, ...]) -> None:
        """Hold what others need of fiber `i` of the share, if there are any."""
        if len(self.force):
            self.force[i], self.resisted[i], self.mobility[i] = about[:3]
            self.own[i], self.tangent[i], self.curvature[i] = about[3:]

    def solve(self, right: Array) -> Array:
        """Return A^-1 right, both (fiber of the share, 4 N - 1)."""
        out = np.empty_like(right)

        def one(k: int) -> None:
            # the matrix was factored as its transpose, which is how LAPACK reads C order
            out[k], _ = _solved(*self.factors[k], right[k], trans=1)

        self._workers.for_each(len(out), one, block=_BLOCK)
        return out

    def resisted_force(self, force: Array) -> Array:
        """Return Lambda f + K f of each fiber of the share, (fiber, 3, N)."""
        out = np.empty_like(force)

        def one(k: int) -> None:
            out[k] = kernels.resisted_force(self.mobility[k], force[k])

        self._workers.for_each(len(out), one, block=_BLOCK)
        return out

    def split(self, found: Array) -> tuple[Array, Array]:
        """Return modes (fiber, 3, N) and tensions (fiber, N - 1) of a solution.

        It is that of the share or of all fibers.
        """
        rows = 3 * self._nodes
        scale = self.scale if len(found) == len(self.scale) else self.scale[self.rows]
        modes = found[:, :rows].reshape(-1, 3, self._nodes)
        return modes, found[:, rows:] / scale[:, None]


class IncrementSolver:
    """Solves for the increments of one Newton pass.

    Parameters
    ----------
    moving
        The fibers, the fluid's drag on them, and how they act on each other.
    workers
        Threads and ranks; all ranks must solve together, with the same arguments.
    """

    def __init__(self, moving: FibersInFluid, workers: Workers) -> None:
        fibers, interaction = moving.fibers, moving.interaction
        self._fibers = fibers
        self._workers = workers
        self._interaction = None if interaction is None or interaction.alone else interaction
        self._tables = [f.kernel_tables for f in fibers]
        self._drags = [f.drag_number(moving.drag) for f in fibers]
        self._unit = force_units(fibers)

    def solve(self, state: State, rate: Array, around: Surroundings, how: Pass) -> Increment:
        """Return the increments about `state`, whose rate of change is predicted as `rate`.

        Raises
        ------
        numpy.linalg.LinAlgError
            If the system is singular or not finite, or GMRES does not reach its reduction.
        """
        systems = self._assembled(state, rate, around, how)
        if self._interaction is None:
            found, iterations = systems.together(systems.solve(systems.right)), 1
            summed = Summed()
        else:
            scene = self._interaction.scene(state.modes, around.time, self._workers)
            found, iterations = self._coupled(systems, scene, how.reduction)
            summed = scene.summed
        if not np.isfinite(found).all():
            raise np.linalg.LinAlgError("the step is not finite")
        return Increment(*systems.split(found), systems.ratio, iterations, summed)

    def others(self, state: State, t: float, force: Array, resisted: Array) -> Array:
        """Return what others add to M f at the nodes, (fiber, 3, N), in units of E / L^3.

        A rank does it by itself.
        """
        if self._interaction is None:
            return np.zeros_like(force)
        scene = self._interaction.scene(state.modes, t, self._workers.alone)
        return scene.velocity(self._unit * force, self._unit * resisted) / self._unit

    def _assembled(self, state: State, rate: Array, around: Surroundings, how: Pass) -> _Systems:
        count = len(self._fibers)
        others = self._interaction is not None
        systems = _Systems(count, self._fibers[0].count, self._workers, others=others)
        scale, ratio = systems.scale[systems.rows], systems.ratio[systems.rows]

        def one(i: int) -> None:
            k = systems.share[i]
            matrix, systems.right[i], scale[i], ratio[i], *about = kernels.increment_system(
                state.modes[k],
                state.tensions[k],
                rate[k],
                around.flow[k],
                around.gradient[k],
                around.load[k],
                how.alpha,
                how.implicit,
                self._drags[k],
                *self._tables[k],
            )
            systems.tell(i, tuple(about))
            lu, pivots, info = _factored(matrix.T, overwrite_a=True)
            if info > 0:
                raise np.linalg.LinAlgError("the equations of a fiber are singular")
            systems.factors[i] = lu, pivots

        singular = False
        try:
            self._workers.for_each(len(systems.share), one)
        except np.linalg.LinAlgError:
            singular = True
        if self._workers.team.any(singular):
            raise np.linalg.LinAlgError("the equations of a fiber are singular")
        self._workers.team.complete(systems.scale)
        self._workers.team.complete(systems.ratio)
        return systems

    def _coupled(
        self, systems: _Systems, scene: AbstractSpectralScene, reduction: float
    ) -> tuple[Array, int]:
        """Return the solution of the coupled system and the iterations."""
        table, slopes = self._fibers[0].tension_tables
        shift = systems.scale[:, None, None] / self._unit
        rows = 3 * systems.own.shape[1]

        def velocity(force: Array, resisted: Array) -> Array:
            """By all fibers at all nodes, from the forces of each rank's share."""
            both = systems.together(np.concatenate([force, resisted], axis=1))
            return shift * scene.velocity(self._unit * both[:, :3], self._unit * both[:, 3:])

        def by_force(found: Array) -> Array:
            """C D: the velocities that the increments of each rank's share bring about."""
            modes, tensions = systems.split(found)
            force = np.matmul(modes, systems.own.transpose(0, 2, 1))
            # fiber by fiber: the bits must not depend on how many there are
            force -= np.matmul(tensions[:, None], table.T) * systems.curvature
            force -= np.matmul(tensions[:, None], slopes.T) * systems.tangent
            return velocity(force, systems.resisted_force(force))

        def own(u: Array) -> Array:
            right = np.zeros_like(systems.right)
            right[:, :rows] = u[systems.rows].reshape(len(right), -1)
            return systems.solve(right)

        def operator(u: Array) -> tuple[Array, Array]:
            answer = own(u)
            return u + by_force(answer), answer

        first = systems.solve(systems.right) - own(velocity(systems.force, systems.resisted))
        right = by_force(first)
        most = min(_MOST_ITERATIONS, max(_FEWEST_ITERATIONS, _BASIS // right.size))
        change, iterations = gmres(operator, right, reduction=reduction, most=most)
        return systems.together(first - change), iterations
