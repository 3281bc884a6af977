"""What fibers by themselves do with more nodes, and how much of an error in it lasts.

A fiber's own operator is integrated on its nodes, which may not resolve a turn of it that is near.
With about twice the nodes the same force gives a velocity that differs by that error. Not all of it
moves the shape: what varies fast along a fiber relaxes at once. With 1 / tau the rate at which the
fiber turns and bends, what lasts of a velocity v is q with

    q + tau a E / (8 pi mu) q_ssss = v,

the local operator's share of the relaxation, in modes with free ends.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from stokesfibers.core.arrays import Array
from stokesfibers.core.parallel import Workers
from stokesfibers.fiber.parameters import Fiber
from stokesfibers.problem.discretised import spectral_fibers
from stokesfibers.problem.problem import Problem
from stokesfibers.slender.spectral import SpectralFiber
from stokesfibers.slender.spectral_forces import elastic_forces, force_units, resisted_forces


def more_than(nodes: int) -> int:
    """Return the next number of nodes from 1.5 times as many on that is 2^k or 3 2^k.

    There are few of them: a run that adds nodes need not find weights anew for each number.
    """
    power = 2 ** int(np.ceil(np.log2(1.5 * nodes)))
    return 3 * power // 4 if 3 * power // 4 >= 1.5 * nodes else power


class MoreNodes:
    """The fibers of a problem, their own operators on more nodes.

    Parameters
    ----------
    problem
        The case.
    fibers
        On the run's nodes.
    workers
        Threads that share the fibers.
    """

    def __init__(
        self, problem: Problem, fibers: tuple[SpectralFiber, ...], workers: Workers
    ) -> None:
        self._problem = problem
        self._fibers = fibers
        self._workers = workers

    @cached_property
    def _fine(self) -> tuple[SpectralFiber, ...]:
        return spectral_fibers(self._problem, more_than(self._fibers[0].count))

    @cached_property
    def _there(self) -> Array:
        """Values at the nodes to values at more of them, (N, more)."""
        coarse, fine = self._fibers[0], self._fine[0]
        return coarse.between_nodes(np.eye(coarse.count), coarse.length * fine.sigma)

    @cached_property
    def _back(self) -> Array:
        """Values at more nodes to values at the nodes, (more, N)."""
        coarse, fine = self._fibers[0], self._fine[0]
        return fine.between_nodes(np.eye(fine.count), fine.length * coarse.sigma)

    def resisted(self, modes: Array, tensions: Array, load: Array) -> Array:
        """Return (Lambda + K_delta)[f] of each fiber at the run's nodes, (fiber, 3, N).

        Parameters
        ----------
        modes, tensions
            Position modes (fiber, 3, N) and tension modes (fiber, N - 1).
        load
            External force per length at the run's nodes, (fiber, 3, N).
        """
        unit, added = force_units(self._fibers), self._fine[0].count - self._fibers[0].count
        more = np.pad(modes, [(0, 0), (0, 0), (0, added)])
        elastic = elastic_forces(self._fine, more, np.pad(tensions, [(0, 0), (0, added)]))
        force = elastic - (load / unit) @ self._there
        return unit * (resisted_forces(self._fine, more, force, self._workers) @ self._back)

    def lasting(self, velocity: Array, tau: float) -> Array:
        """Return what lasts for a time `tau` of `velocity` (fiber, 3, N)."""
        found = np.empty_like(velocity)
        kinds: dict[Fiber, list[int]] = {}
        for k, kind in enumerate(self._problem.fibers):
            kinds.setdefault(kind, []).append(k)
        for own in kinds.values():
            fiber = self._fibers[own[0]]
            relaxing = tau * fiber.local.a / fiber.drag_number(self._problem.drag)
            values, bending = fiber.tables[0], fiber.tables[3]
            lasts = values @ np.linalg.inv(values + relaxing * bending)
            found[own] = velocity[own] @ lasts.T
        return found
