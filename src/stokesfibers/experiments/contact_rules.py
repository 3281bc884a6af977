"""The velocity next to a filament by four rules, as the two engines have them, without the blend.

The paper's engine: the trapezoidal rule on its nodes, and the refinement of Section 3.3.3. The
high-order engine: its nodes alone, and the rule of runs, which takes a tolerance.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from stokesfibers.core.arrays import Array, Points
from stokesfibers.core.parallel import Workers
from stokesfibers.domain import Free
from stokesfibers.experiments.close_pair_curves import Filament
from stokesfibers.experiments.contact_scenes import Curve, integrated_force
from stokesfibers.slender.discrete import DiscreteFiber
from stokesfibers.slender.mobility import NonLocal
from stokesfibers.slender.regularization import SpheroidalRegularization
from stokesfibers.slender.spectral import SpectralFiber
from stokesfibers.slender.spectral_suspension import SpectralInteraction, SpectralScene
from stokesfibers.slender.suspension import Interaction, Scene
from stokesfibers.summation.close_approach import PaperCloseApproach
from stokesfibers.summation.images import ImageSum

PAPER_RULES = {
    "trapezoidal": PaperCloseApproach(d0=1e-9, near=0.0),
    "refined": PaperCloseApproach(d0=1e-9),
}
"""Without and with the refinement; the tiny d_0 switches the blend off."""
_NO_BLEND = PaperCloseApproach(d0=1e-9)


def by_paper(source: Filament, points: Points, *, eps: float, intervals: int) -> dict[str, Points]:
    """Return the velocity at points (point, 3) by both rules of the paper's engine."""
    fiber = DiscreteFiber.build(1.0, eps, rigidity=1.0, intervals=intervals, mobility=NonLocal())
    shape = source.sample(fiber.nodes)
    force = integrated_force(fiber.nodes)[None]
    found = {}
    for name, approach in PAPER_RULES.items():
        interaction = Interaction.build(
            (fiber,), Free(), image_sum=ImageSum(), close_approach=approach
        )
        scene = Scene(interaction, (shape,), Workers(1))
        found[name] = scene.fluid(points, force, np.zeros_like(force))
    return found


@dataclass(frozen=True)
class SpectralSource:
    """A filament in Legendre modes.

    Attributes
    ----------
    fiber
        Its discretisation.
    modes
        Its shape, (3, N).
    """

    fiber: SpectralFiber
    modes: Array

    @classmethod
    def of(cls, source: Filament, *, eps: float, nodes: int) -> SpectralSource:
        """Discretise `source`."""
        fiber = SpectralFiber.build(
            1.0, eps, rigidity=1.0, nodes=nodes, mobility=NonLocal(SpheroidalRegularization())
        )
        return cls(fiber, fiber.fit(lambda s: source.sample(s).x.T))

    def position(self, s: Array) -> Array:
        """Return the centreline, as the modes have it, at arclengths s, (3, n)."""
        return self.fiber.position(self.modes, s)

    def velocity(self, points: Points, force: Curve, tolerance: float | None) -> Points:
        """Return the velocity at points (point, 3); without a tolerance by the nodes alone."""
        interaction = SpectralInteraction.build(
            (self.fiber,),
            Free(),
            image_sum=ImageSum(),
            close_approach=_NO_BLEND,
            tolerance=tolerance or 1e-6,
        )
        if tolerance is None:
            nowhere = replace(interaction.close, reach=np.zeros(1), rho=0.0)
            interaction = replace(interaction, close=nowhere)
        scene = SpectralScene(interaction, self.modes[None], Workers(1))
        density = np.ascontiguousarray(force(self.fiber.sigma))[None]
        return scene.fluid(points, density, np.zeros_like(density))
