"""What is measured of a moment: stress (48), elastic energy (49), orientation, length error.

Each function takes a `Snapshot` and returns an array without the time axis; names, axes, units and
symbols are in ``core/variables.py``. Stresses are per fiber and not divided by a volume.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np

from stokesfibers.core.arrays import Array
from stokesfibers.domain import Sheared
from stokesfibers.domain.neighbours import Closest, closest
from stokesfibers.load import NoLoad
from stokesfibers.observe.snapshot import Snapshot
from stokesfibers.slender.discrete import DiscreteFiber
from stokesfibers.slender.sampled import radii


@lru_cache(maxsize=1)
def fiber_stress(snapshot: Snapshot) -> Array:
    """Return the extra stress (48) of each fiber, (fiber, 3, 3).

    Sigma = int f x ds with f = -(T x_s)_s + E x_ssss, in the form got by integrating by parts
    with the free-end conditions: int (T x_s x_s + E x_ss x_ss) ds. It is symmetric as the
    exact stress of a torque-free fiber is, and positive along a fiber under tension.
    """
    pull = snapshot.weights * snapshot.tension
    stiff = snapshot.weights * snapshot.rigidities[:, None]
    tensile = np.matmul(pull[:, None] * snapshot.xs, snapshot.xs.transpose(0, 2, 1))
    return tensile + np.matmul(stiff[:, None] * snapshot.xss, snapshot.xss.transpose(0, 2, 1))


def fiber_stress_direct(snapshot: Snapshot) -> Array:
    """Return int f x ds exactly as (48) is printed, (fiber, 3, 3): symmetric to O(h^2) only.

    For fibers on the paper's grid.
    """
    values = []
    for fiber, shape, tension in zip(
        snapshot.fibers, snapshot.shapes, snapshot.tension, strict=True
    ):
        assert isinstance(fiber, DiscreteFiber)
        force = fiber.elastic_force(shape, tension)
        values.append(np.einsum("in,jn->ijn", force, shape.x))
    return snapshot.integrate(np.stack(values))


@lru_cache(maxsize=1)  # several observables of a moment are parts of it
def extra_stress(snapshot: Snapshot) -> Array:
    """Return the sum of the fibers' stresses and of the load's, (3, 3)."""
    own, load = fiber_stress(snapshot).sum(axis=0), snapshot.surroundings.load
    return own if isinstance(load, NoLoad) else own + load.stress(snapshot.loaded)


def particle_stress(snapshot: Snapshot) -> Array:
    """Return the extra stress per volume of the triply periodic cell, (3, 3)."""
    return extra_stress(snapshot) / snapshot.surroundings.domain.volume


def smallest_distance(snapshot: Snapshot) -> Array:
    """Return the smallest distance between centrelines, images included."""
    return np.array(_closest(snapshot).distance)


def smallest_gap(snapshot: Snapshot) -> Array:
    """Return the smallest distance between surfaces, with r(s) = 2 eps sqrt(s (L - s))."""
    return np.array(_closest(snapshot).gap)


@lru_cache(maxsize=1)
def _closest(snapshot: Snapshot) -> Closest:
    surfaces = np.stack([radii(f) for f in snapshot.fibers])
    return closest(snapshot.positions, surfaces, snapshot.surroundings.domain)


def first_normal_stress_difference(snapshot: Snapshot) -> Array:
    """Return N_1 = Sigma_11 - Sigma_22."""
    stress = extra_stress(snapshot)
    return stress[0, 0] - stress[1, 1]


def second_normal_stress_difference(snapshot: Snapshot) -> Array:
    """Return N_2 = Sigma_22 - Sigma_33."""
    stress = extra_stress(snapshot)
    return stress[1, 1] - stress[2, 2]


def shear_stress(snapshot: Snapshot) -> Array:
    """Return Sigma_12."""
    return extra_stress(snapshot)[0, 1]


def intrinsic_viscosity(snapshot: Snapshot) -> Array:
    """Return Sigma_12 / (mu rate sum L^3): what the fibers add to the viscosity, by number.

    A suspension with n such fibers per volume has the viscosity mu (1 + n L^3 times this), as far
    as the stress at this moment tells. It needs no volume. Divided by 8 pi it is the
    stress in the paper's units. For steady shear only.
    """
    cubes = np.sum(snapshot.lengths**3)
    return shear_stress(snapshot) / (_background_stress(snapshot) * cubes)


def specific_viscosity(snapshot: Snapshot) -> Array:
    """Return Sigma_12 / (V mu rate), the relative viscosity less 1, V the cell's volume.

    Relative viscosity is that of the suspension over that of the fluid, so that this is the
    fibers' contribution. For steady shear, periodic in three directions.
    """
    volume = snapshot.surroundings.domain.volume
    return shear_stress(snapshot) / (_background_stress(snapshot) * volume)


def _background_stress(snapshot: Snapshot) -> float:
    stress = snapshot.surroundings.background_stress
    if stress is None:
        raise ValueError("a viscosity needs a steady shear and the fluid's viscosity")
    return stress


def elastic_energy(snapshot: Snapshot) -> Array:
    """Return the elastic energy (49) of each fiber, (fiber,): int E |x_ss|^2 / 2 ds."""
    return 0.5 * snapshot.rigidities * snapshot.integrate(snapshot.bend)


def end_to_end(snapshot: Snapshot) -> Array:
    """Return x(L) - x(0), (fiber, 3)."""
    return snapshot.x[:, :, -1] - snapshot.x[:, :, 0]


def end_to_end_distance(snapshot: Snapshot) -> Array:
    """Return |x(L) - x(0)| of each fiber, (fiber,)."""
    ends = end_to_end(snapshot)
    return np.sqrt(np.sum(ends**2, axis=1))


def centre(snapshot: Snapshot) -> Array:
    """Return the mean position along each fiber, (fiber, 3)."""
    return snapshot.integrate(snapshot.x) / snapshot.lengths[:, None]


@lru_cache(maxsize=1)
def orientation_tensor(snapshot: Snapshot) -> Array:
    """Return the mean over fibers of p p, p the unit end-to-end vector, (3, 3)."""
    ends = end_to_end(snapshot)
    size = end_to_end_distance(snapshot)[:, None]
    unit = ends / np.where(size > 0.0, size, 1.0)
    return unit.T @ unit / len(unit)


def order_parameter(snapshot: Snapshot) -> Array:
    """Return the nematic order S, the largest eigenvalue of (3 <p p> - 1) / 2.

    It is 1 if all fibers are parallel, heads and tails not told apart. Fibers turned every way
    alike have 0; n of them drawn at random have about n^(-1/2), since it is never negative.
    """
    return np.linalg.eigvalsh(1.5 * orientation_tensor(snapshot) - 0.5 * np.eye(3))[-1]


def length_error(snapshot: Snapshot) -> Array:
    """Return |l - L| / L of each fiber, (fiber,), with l the integral of |x_s|."""
    speed = np.sqrt(np.einsum("fin,fin->fn", snapshot.xs, snapshot.xs))
    return np.abs(snapshot.integrate(speed) - snapshot.lengths) / snapshot.lengths


def largest_curvature(snapshot: Snapshot) -> Array:
    """Return the largest |x_ss| of each fiber, (fiber,)."""
    return np.sqrt(snapshot.bend.max(axis=1))


def largest_tension(snapshot: Snapshot) -> Array:
    """Return the largest |T| of each fiber, (fiber,)."""
    return np.abs(snapshot.tension).max(axis=1)


def strain(snapshot: Snapshot) -> Array:
    """Return how far the images of a sheared cell one period up are displaced, over that period."""
    domain = snapshot.surroundings.domain
    assert isinstance(domain, Sheared)
    return np.array(domain.strain)


def time(snapshot: Snapshot) -> Array:
    """Return the time of the snapshot."""
    return np.array(snapshot.time)


OBSERVABLES: dict[str, Callable[[Snapshot], Array]] = {
    f.__name__: f
    for f in (
        time,
        elastic_energy,
        fiber_stress,
        extra_stress,
        first_normal_stress_difference,
        second_normal_stress_difference,
        shear_stress,
        orientation_tensor,
        order_parameter,
        length_error,
        end_to_end,
        end_to_end_distance,
        centre,
        largest_curvature,
        largest_tension,
    )
}
"""What every run records, by the name of its variable."""

AMONG_SEVERAL: dict[str, Callable[[Snapshot], Array]] = {
    f.__name__: f for f in (smallest_distance, smallest_gap)
}
"""What only makes sense with more than one fiber, or images."""

IN_STEADY_SHEAR: dict[str, Callable[[Snapshot], Array]] = {
    "intrinsic_viscosity": intrinsic_viscosity
}
"""What only makes sense where the shear has a constant rate: an oscillating one passes zero."""

IN_A_SHEARED_CELL: dict[str, Callable[[Snapshot], Array]] = {
    "specific_viscosity": specific_viscosity
}
"""What needs both a steady shear and a volume."""

IN_A_CELL: dict[str, Callable[[Snapshot], Array]] = {"particle_stress": particle_stress}
"""What only makes sense where the cell has a volume."""


IN_A_SLIDING_CELL: dict[str, Callable[[Snapshot], Array]] = {"strain": strain}
"""What only makes sense where images slide over each other."""


WHERE: dict[str, dict[str, Callable[[Snapshot], Array]]] = {
    "in every run": OBSERVABLES,
    "with several fibers or images": AMONG_SEVERAL,
    "in steady shear": IN_STEADY_SHEAR,
    "with three periodic directions": IN_A_CELL,
    "in steady shear with three periodic directions": IN_A_SHEARED_CELL,
    "in a sheared cell": IN_A_SLIDING_CELL,
}
"""All observables by where they are recorded."""


def recorded(snapshot: Snapshot) -> dict[str, Callable[[Snapshot], Array]]:
    """Return what a run like the snapshot's records."""
    domain = snapshot.surroundings.domain
    chosen = dict(OBSERVABLES)
    if len(snapshot.fibers) > 1 or domain.lengths.any():
        chosen |= AMONG_SEVERAL
    finite = domain.lengths.all()
    if finite:
        chosen |= IN_A_CELL
    if isinstance(domain, Sheared):
        chosen |= IN_A_SLIDING_CELL
    if snapshot.surroundings.background_stress is not None:
        chosen |= IN_STEADY_SHEAR | (IN_A_SHEARED_CELL if finite else {})
    return chosen
