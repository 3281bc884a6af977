"""Errors of the velocity that one filament induces at the nodes of another, by distance.

The filaments are those of `close_pair_curves`; the code under test is the one of every run,
`Scene`, with four settings of the close approach and two kinds of nodal values.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from stokesfibers.core.arrays import Array
from stokesfibers.core.parallel import Workers
from stokesfibers.domain import Free
from stokesfibers.experiments import close_pair_curves as curves
from stokesfibers.experiments.close_pair_curves import Filament
from stokesfibers.slender.discrete import DiscreteFiber
from stokesfibers.slender.mobility import NonLocal
from stokesfibers.slender.sampled import Shape
from stokesfibers.slender.suspension import Interaction, Scene
from stokesfibers.summation.close_approach import PaperCloseApproach
from stokesfibers.summation.images import ImageSum

RULES = {
    "plain": PaperCloseApproach(near=0.0),
    "refined": PaperCloseApproach(d0=1e-9),
    "all_refined": PaperCloseApproach(d0=1e-9, near=1e6),
    "default": PaperCloseApproach(),
}
"""The plain trapezoidal rule; intervals within 12 h cut in five, and all intervals, both without
the blend below 2 d_0; the default, with it."""
NODAL = ("exact", "differences")
"""x_s and x_sss of the curve, which leaves the error of the rule alone; by (A.1), (A.3)."""
EPSILONS = (1e-2, 1e-3)


def blend_distance(eps: float, intervals: int) -> float:
    """Return d_0 = max(h, 2 eps)."""
    return max(1.0 / intervals, 2.0 * eps)


def errors(levels: Sequence[int], distances: Sequence[float]) -> xr.Dataset:
    """Return the errors at all distances from d_0 on, and the errors of the quadrature.

    An error is the largest over the target's nodes, over the largest velocity there. The rule
    ``"default"`` is measured from 2 d_0 on: below, its blend is a model of its own.

    Parameters
    ----------
    levels
        Intervals, each dividing the last.
    distances
        Smallest distances of the centrelines.
    """
    grids = {(eps, n): _fiber(eps, n) for eps in EPSILONS for n in levels}
    found = np.full((len(RULES), len(NODAL), len(EPSILONS), len(levels), len(distances)), np.nan)
    bound = np.zeros(len(distances))
    lower, nodes = curves.lower_filament(), np.linspace(0.0, 1.0, levels[-1] + 1)
    for m, distance in enumerate(distances):
        upper = curves.upper_filament(distance)
        targets = np.ascontiguousarray(upper.sample(nodes).x.T)
        weight = 0.5 * EPSILONS[0] ** 2
        parts, bound[m] = curves.exact_velocity(lower, targets, weight)
        for i, eps in enumerate(EPSILONS):
            exact = parts[0] + (eps / EPSILONS[0]) ** 2 * parts[1]
            for j, n in enumerate(levels):
                if distance >= blend_distance(eps, n):
                    at_nodes = exact[:: levels[-1] // n]
                    pair = (lower, upper)
                    found[:, :, i, j, m] = _of_all_rules(grids[eps, n], pair, distance, at_nodes)
    return xr.Dataset(
        {
            "error": (("rule", "nodal", "eps", "intervals", "distance"), found),
            "reference_error": (("distance",), bound),
        },
        coords={
            "rule": list(RULES),
            "nodal": list(NODAL),
            "eps": list(EPSILONS),
            "intervals": list(levels),
            "distance": list(distances),
        },
    )


def _fiber(eps: float, intervals: int) -> DiscreteFiber:
    return DiscreteFiber.build(1.0, eps, rigidity=1.0, intervals=intervals, mobility=NonLocal())


def _of_all_rules(
    fiber: DiscreteFiber, pair: tuple[Filament, Filament], distance: float, exact: Array
) -> Array:
    """Return the errors by rule and nodal values, (rule, nodal); `exact` is (node, 3)."""
    found = np.full((len(RULES), len(NODAL)), np.nan)
    sampled = tuple(filament.sample(fiber.nodes) for filament in pair)
    differences = tuple(fiber.shape(shape.x) for shape in sampled)
    size = np.linalg.norm(exact, axis=1).max()
    for r, (name, approach) in enumerate(RULES.items()):
        if name == "default" and distance < 2.0 * blend_distance(fiber.eps, fiber.grid.intervals):
            continue
        for v, shapes in enumerate((sampled, differences)):
            off = velocity_on_upper(fiber, shapes, approach) - exact
            found[r, v] = np.linalg.norm(off, axis=1).max() / size
    return found


def velocity_on_upper(
    fiber: DiscreteFiber, shapes: tuple[Shape, ...], approach: PaperCloseApproach
) -> Array:
    """Return V + (eps L)^2/2 W of the lower filament at the nodes of the upper, (node, 3)."""
    interaction = Interaction.build(
        (fiber, fiber), Free(), image_sum=ImageSum(), close_approach=approach
    )
    scene = Scene(interaction, shapes, Workers(1))
    tension = np.stack([np.asarray(curves.given_tension(fiber.nodes))] * 2)
    force = scene.integrated_force(tension)
    return scene.at_nodes(force, scene.centreline_value(tension))[1].T
