"""Balances that an exact solution keeps: net force and torque of each fiber, power of all.

With f_e = -(T x_s)_s + E x_ssss the elastic force per length, g the load, and f = f_e - g the force
of the fluid on the fiber as in (9), free ends give

    int f_e ds = 0,    int (x - x_c) x f_e ds = 0,

so that the fluid bears the load and nothing else; and the equation of motion (2), (6), times f_e,

    d/dt E_elas + D = P + W,
    D = int f . (U_0 - v) ds,    P = int f . U_0 ds,    W = int g . v ds,

with v the velocity that the model gives to the shapes and tensions: elastic rate and dissipation
equal the power of the flow and of the load. Without regularisation D is what the disturbance
dissipates; with it, its counterpart ``int f . (Lambda + K)[f] ds / (8 pi mu)``, others included.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from stokesfibers.core.arrays import Array, Nodal
from stokesfibers.numerics.chebyshev import ChebyshevGrid
from stokesfibers.observe.snapshot import Snapshot
from stokesfibers.slender.discrete import DiscreteFiber

_LEAST_FORCE = 1e-3
"""Of E / L^2: forces below it are rounding, and their balance says nothing."""


@dataclass(frozen=True)
class Balance:
    """Powers of all fibers at one time, and how far they are from the equation of motion.

    Attributes
    ----------
    time
        When.
    elastic_rate
        d/dt of the elastic energy (49) as the run goes.
    dissipation, flow_power, load_power
        D, P and W, from the velocity of the model.
    defect
        Largest over the fibers of the root mean square of |x_t - v| / L, in 1 / time: x_t as the
        run goes, v as the model says; of what lasts of it, if that is known.
    pace
        The same of x_t less its mean along the fiber: how fast it turns and bends.
    speed
        The same of x_t less the mean of the flow along the fiber: how fast it moves through the
        fluid, where a load drives it, too.
    """

    time: float
    elastic_rate: float
    dissipation: float
    flow_power: float
    load_power: float
    defect: float
    pace: float
    speed: float

    @property
    def residual(self) -> float:
        """Power that is missing: zero for an exact solution."""
        return self.elastic_rate + self.dissipation - self.flow_power - self.load_power


@dataclass(frozen=True)
class Motion:
    """Forces and velocities at the nodes of all fibers, each (fiber, 3, node) unless said.

    Attributes
    ----------
    time
        When.
    elastic
        f_e.
    load
        g.
    flow
        U_0.
    model
        v, by the equation of motion.
    weights
        Quadrature weights in arclength, (fiber, node).
    """

    time: float
    elastic: Array
    load: Array
    flow: Array
    model: Array
    weights: Nodal

    def balance(self, rate: Array, elastic_rate: float) -> Balance:
        """Return the balance for velocities `rate` (fiber, 3, node) of the run itself."""
        force = self.elastic - self.load
        return Balance(
            self.time,
            elastic_rate,
            dissipation=self.power(force, self.flow - self.model),
            flow_power=self.power(force, self.flow),
            load_power=self.power(self.load, self.model),
            defect=self.largest(rate - self.model),
            pace=self.largest(rate - self.mean(rate)),
            speed=self.largest(rate - self.mean(self.flow)),
        )

    def mean(self, velocity: Array) -> Array:
        """Return means along each fiber, (fiber, 3, 1)."""
        total = np.einsum("fin,fn->fi", velocity, self.weights)
        return (total / self.weights.sum(axis=1)[:, None])[:, :, None]

    def largest(self, velocity: Array) -> float:
        """Return the largest over the fibers of the root mean square over L, in 1 / time."""
        lengths = self.weights.sum(axis=1)
        square = np.einsum("fin,fin,fn->f", velocity, velocity, self.weights)
        return float(np.max(np.sqrt(square / lengths) / lengths))

    def power(self, force: Array, velocity: Array) -> float:
        """Return the integral of force . velocity over all fibers."""
        return float(np.einsum("fin,fin,fn->", force, velocity, self.weights))


def force_error(snapshot: Snapshot) -> Array:
    """Return |int f_e ds| / int |f_e| ds of each fiber, (fiber,)."""
    force, scale = _force_and_scale(snapshot)
    return np.linalg.norm(snapshot.integrate(force), axis=1) / scale


def torque_error(snapshot: Snapshot) -> Array:
    """Return |int (x - x_c) x f_e ds| / (L int |f_e| ds) of each fiber, (fiber,)."""
    force, scale = _force_and_scale(snapshot)
    centre = snapshot.integrate(snapshot.x) / snapshot.lengths[:, None]
    torque = np.cross(snapshot.x - centre[:, :, None], force, axis=1)
    return np.linalg.norm(snapshot.integrate(torque), axis=1) / (scale * snapshot.lengths)


@lru_cache(maxsize=1)
def _force_and_scale(snapshot: Snapshot) -> tuple[Array, Array]:
    """Return f_e at the nodes (fiber, 3, node), and int |f_e| ds with a floor, (fiber,)."""
    force = elastic_force(snapshot)
    size = snapshot.integrate(np.sqrt(np.einsum("fin,fin->fn", force, force)))
    return force, size + _LEAST_FORCE * snapshot.rigidities / snapshot.lengths**2


def elastic_force(snapshot: Snapshot) -> Array:
    """Return f_e = E x_ssss - T_s x_s - T x_ss at the nodes, (fiber, 3, node)."""
    bending = np.stack([shape.xssss for shape in snapshot.shapes])
    slope = np.empty_like(snapshot.tension)
    for k, fiber in enumerate(snapshot.fibers):
        if isinstance(fiber, DiscreteFiber):
            slope[k] = fiber.derivative(snapshot.tension[k])
        else:
            assert isinstance(fiber.grid, ChebyshevGrid)
            slope[k] = _derivative(fiber.grid) @ snapshot.tension[k]
    tensile = slope[:, None] * snapshot.xs + snapshot.tension[:, None] * snapshot.xss
    return snapshot.rigidities[:, None, None] * bending - tensile


@lru_cache(maxsize=32)
def _derivative(grid: ChebyshevGrid) -> Array:
    """Return the matrix of d/ds on Chebyshev points, (node, node); barycentric."""
    away = grid.nodes[:, None] - grid.nodes
    np.fill_diagonal(away, 1.0)
    signs = (-1.0) ** np.arange(len(away))
    signs[[0, -1]] *= 0.5
    matrix = signs / signs[:, None] / away
    np.fill_diagonal(matrix, 0.0)
    np.fill_diagonal(matrix, -matrix.sum(axis=1))
    return matrix
