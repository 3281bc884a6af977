"""The slender-body operators of one kind of fiber on a uniform grid: arrays in, arrays out.

Owns the discrete forms of Lambda (21) and K_delta (24) that the paper's scheme needs. Array axes
are (3, node): component first, as the kernels want them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from stokesfibers.core.arrays import Array
from stokesfibers.kernels import slender as kernels
from stokesfibers.numerics.finite_differences import UniformGrid
from stokesfibers.numerics.product_integration import FinitePartWeights
from stokesfibers.slender.mobility import AbstractMobility, LocalOperator
from stokesfibers.slender.sampled import Shape


@dataclass(frozen=True, eq=False)
class DiscreteFiber:
    """Grid, local operator and finite-part weights of one kind of fiber.

    Attributes
    ----------
    grid
        Uniform grid on [0, L].
    rigidity
        E.
    eps
        Slenderness.
    local
        Coefficients of the local operator.
    weights
        Weights of the finite-part operator, for unit length.
    """

    grid: UniformGrid
    rigidity: float
    eps: float
    local: LocalOperator
    weights: FinitePartWeights

    @classmethod
    def build(
        cls,
        length: float,
        eps: float,
        *,
        rigidity: float,
        intervals: int,
        mobility: AbstractMobility,
    ) -> DiscreteFiber:
        """Discretise a fiber with `intervals` intervals under `mobility`."""
        return cls(
            grid=UniformGrid(length, intervals),
            rigidity=rigidity,
            eps=eps,
            local=mobility.local(eps),
            weights=mobility.weights(intervals, eps),
        )

    @cached_property
    def _differences(self) -> Array:
        return self.grid.stacked_differences()

    @cached_property
    def nodes(self) -> Array:
        """Arclength of the nodes."""
        return self.grid.nodes

    @cached_property
    def _delta(self) -> Array:
        return self.weights.delta * self.grid.length

    @cached_property
    def _at_nodes(self) -> tuple[Array, Array, Array, Array, Array, Array]:
        """What the kernels need at the nodes: s, delta and the weights of the finite part."""
        w = self.weights
        return (self.nodes, self._delta, w.hat, w.hat_square, w.hat_product, w.phi)

    @cached_property
    def _delta_half(self) -> Array:
        return self.weights.delta_half * self.grid.length

    def shape(self, x: Array) -> Shape:
        """Return positions of shape (3, node) with their four difference derivatives."""
        x = np.ascontiguousarray(x)
        d1, d2, d3, d4 = self._differences
        return Shape(x, *(np.ascontiguousarray(x @ d.T) for d in (d1, d2, d3, d4)))

    def derivative(self, values: Array) -> Array:
        """Return D_1 of nodal values, (..., node)."""
        return values @ self._differences[0].T

    def finite_part(self, shape: Shape, g: Array) -> Array:
        """Return K_delta[g] of (24) at the nodes, by (30), (31); g of shape (3, node)."""
        return kernels.apply_finite_part(
            shape.x,
            shape.xs,
            *self._at_nodes,
            np.ascontiguousarray(g),
        )

    def tensile_force(self, shape: Shape, tension: Array) -> Array:
        """Return (T x_s)_s = T_s x_s + T x_ss at the nodes, (3, node)."""
        return self.derivative(tension) * shape.xs + tension * shape.xss

    def elastic_force(self, shape: Shape, tension: Array) -> Array:
        """Return f = -(T x_s)_s + E x_ssss of (9) at the nodes, (3, node)."""
        return self.rigidity * shape.xssss - self.tensile_force(shape, tension)

    def tensile_velocity(self, shape: Shape, tension: Array) -> Array:
        """Return (Lambda + K_delta)[(T x_s)_s], times 8 pi mu a velocity; (3, node).

        The local part uses x_s . x_s = 1 and x_s . x_ss = 0, as (21) does.
        """
        local = (self.local.a + self.local.b) * self.derivative(tension) * shape.xs
        local += self.local.a * tension * shape.xss
        return local + self.finite_part(shape, self.tensile_force(shape, tension))

    def mobility_velocity(self, shape: Shape, g: Array) -> Array:
        """Return (Lambda + K_delta)[g] for any force per length g (3, node); (3, node)."""
        along = shape.xs * np.sum(shape.xs * g, axis=0)
        return self.local.a * g + self.local.b * along + self.finite_part(shape, g)

    def tensile_matrix(self, shape: Shape) -> Array:
        """Return the matrix of `tensile_velocity` for nodal tensions, (3, node, node)."""
        return kernels.tensile_matrix(
            shape.x,
            shape.xs,
            shape.xss,
            *self._at_nodes,
            self.local.a,
            self.local.b,
            self._differences[0],
        )

    def bending_velocity(self, shape: Shape) -> Array:
        """Return -(Lambda + K_delta)[E x_ssss], times 8 pi mu a velocity; (3, node)."""
        return -self.mobility_velocity(shape, self.rigidity * shape.xssss)

    def evolution_matrix(self, shape: Shape, factor: float) -> Array:
        """Return I + factor E (Lambda + K_delta) D_4 with the free-end rows, (3 node, 3 node)."""
        _, d2, d3, d4 = self._differences
        return kernels.evolution_matrix(
            shape.x,
            shape.xs,
            *self._at_nodes,
            self.local.a,
            self.local.b,
            factor * self.rigidity,
            d2,
            d3,
            d4,
        )

    def tension_coupling(self, shape: Shape) -> tuple[Array, Array]:
        """Return matrix and bending term of the non-local part of (22), (34); see the kernel."""
        w = self.weights
        return kernels.tension_coupling(
            shape.x,
            shape.xs,
            shape.xss,
            shape.xsss,
            shape.xssss,
            self.nodes,
            self._delta_half,
            w.moments_half,
            w.phi_half,
            w.phi_0,
            w.hat,
            w.phi,
        )
