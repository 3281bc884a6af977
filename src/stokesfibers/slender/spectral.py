"""The slender-body operators of one kind of fiber in Legendre modes: arrays in, arrays out.

Modes and nodal arrays are component first, (3, N), and for unit length: the fiber's length enters
where arclengths, positions and forces go in and out. Owns the spectral form of the operators in
(20): collocation at N Gauss-Legendre nodes, inextensibility at N - 1 others.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from stokesfibers.core import checks
from stokesfibers.core.arrays import Array, Points, as_float
from stokesfibers.core.errors import InputError
from stokesfibers.fiber.parameters import Fiber
from stokesfibers.kernels import spectral as kernels
from stokesfibers.numerics.legendre import (
    LEAST_NODES,
    FreeEndBasis,
    gauss_legendre,
    legendre_values,
)
from stokesfibers.numerics.shape_free import ShapeFreeWeights, no_weights, shape_free_weights
from stokesfibers.slender.mobility import AbstractMobility, LocalDrag, LocalOperator, NonLocal
from stokesfibers.slender.regularization import AbstractRegularization, SpheroidalRegularization

FIT_OVERSAMPLING = 2
"""Points per mode when a curve is turned into modes."""
_TAIL = 4  # modes: even and odd ones decay apart
_TAIL_TO_ERROR = 6.0  # shape error over the size of the last modes, as measured


@dataclass(frozen=True)
class Resolution:
    """How well shapes are resolved, judged by the decay of their modes.

    Attributes
    ----------
    error
        Estimated error of each shape through lack of nodes, relative to the length, (...).
    middle
        The same from the modes in the middle, (...).
    nodes
        Number of nodes.
    """

    error: Array
    middle: Array
    nodes: int

    @property
    def decay(self) -> Array:
        """Rate: the error falls like exp(-decay nodes); zero if the modes do not decay, (...)."""
        falls = (self.middle > self.error) & (self.error > 0.0)
        ratio = np.divide(self.middle, self.error, out=np.ones_like(self.error), where=falls)
        return np.log(ratio) / (self.nodes - _TAIL - self.nodes // 2)

    def nodes_for(self, tolerance: float) -> NDArray[np.int64]:
        """Return the numbers of nodes, even ones, that would err by `tolerance`, (...)."""
        with np.errstate(divide="ignore", invalid="ignore"):
            more = np.log(np.maximum(self.error, 1e-300) / tolerance) / self.decay
        stuck = np.where(self.error <= tolerance, 0.0, self.nodes)
        wanted = self.nodes + np.where(self.decay > 0.0, more, stuck)
        return 2 * np.ceil(0.5 * np.clip(wanted, LEAST_NODES, 2 * self.nodes)).astype(np.int64)


@dataclass(frozen=True)
class SpectralFiber:
    """Modes, local operator and finite-part weights of one kind of fiber.

    Attributes
    ----------
    length
        L.
    rigidity
        E.
    eps
        Slenderness.
    basis
        Position and tension modes on [0, 1]; `basis.count` is N.
    local
        Coefficients of the local operator.
    weights
        Shape-free weights of the finite-part operator.
    """

    length: float
    rigidity: float
    eps: float
    basis: FreeEndBasis
    local: LocalOperator
    weights: ShapeFreeWeights

    @classmethod
    def build(
        cls,
        length: float,
        eps: float,
        *,
        rigidity: float,
        nodes: int,
        mobility: AbstractMobility,
    ) -> SpectralFiber:
        """Discretise a fiber with `nodes` nodes under `mobility`."""
        return cls(
            length=checks.positive("length", length),
            rigidity=checks.positive("rigidity", rigidity),
            eps=checks.positive("eps", eps),
            basis=FreeEndBasis(nodes),
            local=mobility.local(eps),
            weights=mobility_weights(mobility, nodes, eps),
        )

    @property
    def count(self) -> int:
        """Number of nodes and of position modes per component, N."""
        return self.basis.count

    @cached_property
    def sigma(self) -> Array:
        """The nodes as fractions of the length, (N,)."""
        return gauss_legendre(self.count)[0]

    @cached_property
    def quadrature(self) -> Array:
        """Weights of integrals over arclength from nodal values, (N,); they add up to L."""
        return self.length * gauss_legendre(self.count)[1]

    @cached_property
    def tables(self) -> Array:
        """Position modes and their derivatives 1, 2, 4 at the nodes, (4, N, N)."""
        return np.stack([self.basis.positions(self.sigma, order) for order in (0, 1, 2, 4)])

    @cached_property
    def tension_tables(self) -> Array:
        """Tension modes and their slopes at the nodes, (2, N, N - 1)."""
        return np.stack([self.basis.tensions(self.sigma, order) for order in (0, 1)])

    @cached_property
    def constraint(self) -> Array:
        """Slopes of the position modes where |x_s| = 1 is imposed, (11), (N - 1, N)."""
        return self.basis.positions(gauss_legendre(self.count - 1)[0], 1)

    @cached_property
    def stacked_weights(self) -> Array:
        """Finite-part weights and their corrections as the kernels want them, (terms, N, N)."""
        return np.concatenate([self.weights.finite[None], self.weights.corrections])

    @cached_property
    def kernel_tables(self) -> tuple[object, ...]:
        """The constant arguments of `kernels.increment_system`, in its order."""
        return (
            self.sigma,
            self.tables,
            self.tension_tables,
            self.constraint,
            self.stacked_weights,
            self.weights.delta,
            self.local.a,
            self.local.b,
        )

    def drag_number(self, drag: float) -> float:
        """Return 8 pi mu L^4 / E, a time, from `drag` = 8 pi mu."""
        return drag * self.length**4 / self.rigidity

    @cached_property
    def force_unit(self) -> float:
        """E / L^2: a tension of the modes times this is in the units of the case."""
        return self.rigidity / self.length**2

    def fit(self, position: Callable[[Array], Points]) -> Array:
        """Return the modes (3, N) of the curve `position`: fractions (n,) to points (n, 3)."""
        sigma, weight = gauss_legendre(FIT_OVERSAMPLING * self.count)
        points = np.asarray(position(sigma), dtype=float)
        if points.shape != (sigma.size, 3) or not np.isfinite(points).all():
            raise InputError("positions", f"finite points ({sigma.size}, 3)", points.shape)
        modes = self.basis.fit(points / self.length, sigma, weight)
        return np.ascontiguousarray(modes.T)

    def position(self, modes: Array, s: Array, order: int = 0) -> Array:
        """Return the derivative of `order` 0 ... 4 by arclength at arclengths s, (3, *s.shape)."""
        table = self._positions_at(s, order)
        return self.length ** (1 - order) * np.moveaxis(table @ modes.T, -1, 0)

    def tension(self, modes: Array, s: Array, order: int = 0) -> Array:
        """Return T, or its slope, at arclengths s from tension modes (N - 1,); s.shape."""
        table = self.basis.tensions(np.asarray(s) / self.length, order)
        return self.force_unit * self.length ** (-order) * (table @ modes)

    def force(self, modes: Array, tension: Array, s: Array) -> Array:
        """Return f = -(T x_s)_s + E x_ssss of (9) at arclengths s, (3, *s.shape)."""
        bend, pull = self.tension(tension, s), self.tension(tension, s, 1)
        tensile = pull * self.position(modes, s, 1) + bend * self.position(modes, s, 2)
        return self.rigidity * self.position(modes, s, 4) - tensile

    def integrated_force(self, modes: Array, tension: Array, s: Array) -> Array:
        """Return F = -T x_s + E x_sss, whose derivative is f and which vanishes at the ends."""
        bending = self.rigidity * self.position(modes, s, 3)
        return bending - self.tension(tension, s) * self.position(modes, s, 1)

    def mobility_velocity(self, modes: Array, force: Array) -> tuple[Array, float]:
        """Return (Lambda + K_delta)[force] at the nodes, (3, N), and the ratio of the series.

        The ratio is the largest ``delta^2 h u^2 w^2``; see `numerics.shape_free`.
        """
        return kernels.resisted_velocity(
            modes,
            np.ascontiguousarray(force),
            self.sigma,
            self.tables,
            self.stacked_weights,
            self.weights.delta,
            self.local.a,
            self.local.b,
        )

    def between_nodes(self, values: Array, s: Array) -> Array:
        """Return the polynomial through nodal `values` (..., N) at s (point,), (..., point)."""
        return values @ (legendre_values(s / self.length, self.count) @ self.to_legendre).T

    @cached_property
    def to_legendre(self) -> Array:
        """Nodal values to Legendre coefficients of the polynomial through them, (N, N)."""
        return as_float(np.linalg.inv(legendre_values(self.sigma, self.count)))

    @cached_property
    def position_series(self) -> Array:
        """Legendre coefficients of the position modes, (N, N + 4): ``modes @ position_series``."""
        sigma, _ = gauss_legendre(self.count + 4)
        values = legendre_values(sigma, sigma.size)
        return as_float(np.linalg.solve(values, self.basis.positions(sigma)).T)

    def resolution(self, modes: Array) -> Resolution:
        """Return how well modes (..., 3, N) resolve their shapes, from their decay."""
        half = self.count // 2
        size = np.sqrt(np.square(modes).sum(axis=-2)) * self._mode_sizes
        tail = size[..., -_TAIL:].max(axis=-1)
        middle = size[..., half : half + _TAIL].max(axis=-1)
        return Resolution(_TAIL_TO_ERROR * tail, _TAIL_TO_ERROR * middle, self.count)

    @cached_property
    def _mode_sizes(self) -> Array:
        """Largest value of each position mode, (N,)."""
        return np.abs(self.basis.positions(np.linspace(0.0, 1.0, 4 * self.count + 1))).max(axis=0)

    def _positions_at(self, s: Array, order: int) -> Array:
        return self.basis.positions(np.asarray(s, dtype=float) / self.length, order)


def by_kind(
    fibers: tuple[Fiber, ...], nodes: int, mobility: AbstractMobility
) -> dict[Fiber, SpectralFiber]:
    """Return the discretised fiber of each kind there is among `fibers`."""
    return {
        kind: SpectralFiber.build(
            kind.length, kind.eps, rigidity=kind.rigidity, nodes=nodes, mobility=mobility
        )
        for kind in dict.fromkeys(fibers)
    }


def mobility_weights(mobility: AbstractMobility, nodes: int, eps: float) -> ShapeFreeWeights:
    """Return the shape-free weights of `mobility` on `nodes` Gauss-Legendre nodes."""
    if isinstance(mobility, NonLocal):
        return _cached_weights(mobility.regularization or SpheroidalRegularization(), nodes, eps)
    if isinstance(mobility, LocalDrag):
        return no_weights(nodes)
    raise InputError("mobility", "NonLocal or LocalDrag", type(mobility).__name__)


@lru_cache(maxsize=32)
def _cached_weights(
    regularization: AbstractRegularization, nodes: int, eps: float
) -> ShapeFreeWeights:
    return shape_free_weights(regularization.delta(gauss_legendre(nodes)[0], eps))
