"""One moment of a run as observables see it."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property, lru_cache

import numpy as np

from stokesfibers.core.arrays import Array, Nodal, Positions
from stokesfibers.domain import AbstractDomain, Free
from stokesfibers.flow import AbstractFlow, NoFlow, Shear
from stokesfibers.load import AbstractLoad, LoadedState, NoLoad
from stokesfibers.slender.discrete import DiscreteFiber
from stokesfibers.slender.sampled import SampledFiber, Shape, View


@dataclass(frozen=True)
class Surroundings:
    """What acts on the fibers, and the fluid and the space they are in.

    Attributes
    ----------
    domain
        Free or periodic space.
    load
        External force.
    flow
        Background flow.
    viscosity
        mu, in units of force time / length^2; None if unknown.
    """

    domain: AbstractDomain = field(default_factory=Free)
    load: AbstractLoad = field(default_factory=NoLoad)
    flow: AbstractFlow = field(default_factory=NoFlow)
    viscosity: float | None = None

    @property
    def background_stress(self) -> float | None:
        """mu rate of a steady shear, in units of force / length^2; None in any other flow."""
        if self.viscosity is None or not isinstance(self.flow, Shear) or self.flow.rate == 0.0:
            return None
        return self.viscosity * self.flow.rate


@dataclass(frozen=True, eq=False)
class Snapshot:
    """Shapes and tensions at one time.

    Attributes
    ----------
    time
        Simulated time.
    fibers
        Where each fiber is sampled, and what it is.
    shapes
        Their centrelines.
    tension
        Nodal tensions, (fiber, node).
    surroundings
        Domain and external force.
    """

    time: float
    fibers: tuple[SampledFiber, ...]
    shapes: tuple[Shape, ...]
    tension: Nodal
    surroundings: Surroundings = field(default_factory=Surroundings)

    @classmethod
    def take(
        cls,
        time: float,
        fibers: tuple[DiscreteFiber, ...],
        positions: Positions,
        tension: Nodal,
        *,
        surroundings: Surroundings | None = None,
    ) -> Snapshot:
        """Return the snapshot of positions (fiber, node, space) and tensions (fiber, node)."""
        shapes = tuple(f.shape(x.T) for f, x in zip(fibers, positions, strict=True))
        return cls(time, fibers, shapes, tension, surroundings or Surroundings())

    @classmethod
    def of(cls, view: View, surroundings: Surroundings) -> Snapshot:
        """Return the snapshot of what an engine shows."""
        return cls(view.time, view.fibers, view.shapes, view.tension, surroundings)

    @cached_property
    def x(self) -> Array:
        """Positions, component first, (fiber, 3, node)."""
        return _stacked([shape.x for shape in self.shapes])

    @cached_property
    def xs(self) -> Array:
        """Tangents, (fiber, 3, node)."""
        return _stacked([shape.xs for shape in self.shapes])

    @cached_property
    def xss(self) -> Array:
        """Second derivatives, (fiber, 3, node)."""
        return _stacked([shape.xss for shape in self.shapes])

    @cached_property
    def bend(self) -> Nodal:
        """Curvature squared, (fiber, node)."""
        return np.einsum("fin,fin->fn", self.xss, self.xss)

    @property
    def weights(self) -> Nodal:
        """Quadrature weights in arclength, (fiber, node)."""
        return _of_all(self.fibers)[0]

    @property
    def lengths(self) -> Array:
        """L of each fiber, (fiber,)."""
        return _of_all(self.fibers)[1]

    @property
    def rigidities(self) -> Array:
        """E of each fiber, (fiber,)."""
        return _of_all(self.fibers)[2]

    @property
    def positions(self) -> Positions:
        """Positions, (fiber, node, space)."""
        return np.ascontiguousarray(self.x.transpose(0, 2, 1))

    @property
    def loaded(self) -> LoadedState:
        """What the external force depends on."""
        radii = np.array([f.eps for f in self.fibers]) * self.lengths
        return LoadedState(self.positions, self.weights, radii, self.surroundings.domain, self.time)

    def integrate(self, values: Array) -> Array:
        """Return the integrals over arclength of nodal values (fiber, ..., node), (fiber, ...)."""
        return np.einsum("f...n,fn->f...", values, self.weights)


def _stacked(values: list[Array]) -> Array:
    return values[0][None] if len(values) == 1 else np.stack(values)


@lru_cache(maxsize=8)  # a run is looked at often, and its fibers stay the same
def _of_all(fibers: tuple[SampledFiber, ...]) -> tuple[Nodal, Array, Array]:
    """Return quadrature weights (fiber, node), lengths and rigidities (fiber,)."""
    found = (
        np.stack([f.grid.weights for f in fibers]),
        np.array([f.grid.length for f in fibers]),
        np.array([f.rigidity for f in fibers]),
    )
    for values in found:
        values.flags.writeable = False
    return found
