"""The whole sum over the images of one periodic direction, to rounding, by a few images.

Images |p| <= 1 about the nearest one are summed as they are. Those with |p| >= 2 are replaced by
images at places p_k that are not whole, with weights w_k: a Gauss rule for the sum. With images p
and -p together, and the part of their sum that does not depend on the place left out, the summand
is ``h(p) = p^-3 H(1/p^2)`` with H analytic, so that

    sum_{p >= 2} h(p) = int H(t) dnu(t) = sum_k w_k h(p_k),
    nu = sum_{p >= 2} p^-3 delta(t - 1/p^2),

with the nodes ``t_k = 1/p_k^2`` and weights ``w_k / p_k^3`` of Gauss' rule for the measure nu.
Since nu is made of atoms, the rule finds the nearest ones by itself: the first p_k are 2, 3, 4 to
many digits, and the error falls faster than geometrically. Seen from farther than `FARTHEST`
periods across, the images are a line: the sum is then known in closed form, the difference being
``exp(-2 pi rho / d)``.

What is left out, (I + aa) / |p d| for each image p != 0 (a along the axis, d the period), has no
effect for fibers without a net force; with one, it sets the mean flow.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from stokesfibers.core.arrays import Array
from stokesfibers.core.errors import InputError
from stokesfibers.domain import AbstractDomain
from stokesfibers.summation.images import About, AbstractImageSum

Indices = NDArray[np.intp]

FARTHEST = 5.0
"""Distance from the axis of the images, in periods, beyond which the sum is that of a line."""
_FEWEST = 3
_MARGIN = 8  # more places than `_PLACES`, to compare with
_PLACES = 10  # reaches 1e-12 up to FARTHEST across and 1.5 periods along the axis
_FIRST = 2  # the first image that is replaced
_ATOMS = 3000  # beyond, the sum over p is an integral, to 1e-15
_TAIL_RULE = 20


@cache
def replaced_images(places: int = _PLACES) -> tuple[Array, Array]:
    """Return the places p_k, ascending, and weights w_k that stand for p = 2, 3, ..., (place,).

    From the measure nu by Lanczos' process, every vector made orthogonal to all before it.
    """
    p = np.arange(_FIRST, _ATOMS, dtype=float)
    z, w = np.polynomial.legendre.leggauss(_TAIL_RULE)
    edge = 1.0 / (_ATOMS - 0.5)
    inverse = np.concatenate([1.0 / p, 0.5 * edge * (1.0 + z)])
    mass = np.concatenate([p**-3.0, 0.5 * edge * w * 0.5 * edge * (1.0 + z)])
    t = (_FIRST * inverse) ** 2
    basis = np.zeros((places, t.size))
    diagonal, beside = np.zeros(places), np.zeros(places)
    total = np.sqrt(mass.sum())
    vector = np.sqrt(mass) / total
    for k in range(places):
        basis[k] = vector
        fresh = t * vector
        diagonal[k] = vector @ fresh
        for _ in range(2):
            fresh = fresh - basis[: k + 1].T @ (basis[: k + 1] @ fresh)
        beside[k] = np.linalg.norm(fresh)
        vector = fresh / beside[k]
    matrix = np.diag(diagonal) + np.diag(beside[:-1], 1) + np.diag(beside[:-1], -1)
    values, vectors = np.linalg.eigh(matrix)
    at = _FIRST / np.sqrt(values[::-1])
    return at, (total * vectors[0, ::-1]) ** 2 * at**3


@cache
def places_needed(tolerance: float) -> tuple[int, ...]:
    """Return how many places reach `tolerance` at 0 ... 1, 1 ... 2, ... periods across.

    It is relative to the inverse of the period, up to 1.5 periods along the axis: fibers of the
    length of the period whose middles are half a period apart.
    """
    counts = range(_FEWEST, _PLACES + 1)
    needed = []
    for ring in range(int(FARTHEST)):
        fine = _sample(*replaced_images(_PLACES + _MARGIN), ring + 1.0)
        errors = [np.abs(_sample(*replaced_images(n), ring + 1.0) - fine).max() for n in counts]
        good = [n for n, e in zip(counts, errors, strict=True) if e <= tolerance]
        needed.append(good[0] if good else _PLACES)
    return tuple(needed)


def _sample(p: Array, w: Array, across: float) -> Array:
    """Return sums of 1/r, a^2/r^3 and a/r^3 over images, at the farthest place along the axis."""
    total = np.zeros(3)
    for sign in (1.0, -1.0):
        a = 1.5 + sign * p
        r = np.hypot(a, across)
        terms = w * np.stack([1.0 / r - 1.0 / p, a**2 / r**3 - 1.0 / p, across * a / r**3])
        total = total + terms.sum(axis=1)
    return total


@dataclass(frozen=True)
class ReplacedImages:
    """The images |p| >= 2 of one direction, as the kernels take them.

    Attributes
    ----------
    axis
        Index of the periodic direction.
    period
        d.
    places, weights
        Where images stand for the others, along the axis, and their weights; padded (rule, most).
    sizes
        Images of each rule, (rule,).
    constants
        What (I + aa) / r is lessened by in sum, those of p = 1 and -1 included, (rule,).
    rule_at
        The rule for 0 ... 1, 1 ... 2, ... periods across, (`FARTHEST`,).
    """

    axis: int
    period: float
    places: Array
    weights: Array
    sizes: Indices
    constants: Array
    rule_at: Indices

    @property
    def arguments(self) -> tuple[int, float, Array, Array, Indices, Array, Indices]:
        """What `kernels.spectral_images.image_block` takes."""
        rules = self.places, self.weights, self.sizes, self.constants
        return (self.axis, self.period, *rules, self.rule_at)


@dataclass(frozen=True)
class ExactImages(AbstractImageSum):
    """All images of one periodic direction, (40), for the high-order engine."""

    kind: ClassVar[str] = "exact"
    citation: ClassVar[str] = "stokesfibers, theory page 'Periodic images'"
    most_directions: ClassVar[int] = 1
    reach: ClassVar[int] = 1  # pyright: ignore[reportIncompatibleVariableOverride]
    about: ClassVar[About] = "centre_of_mass"  # pyright: ignore[reportIncompatibleVariableOverride]

    def shifts(self, domain: AbstractDomain) -> tuple[Array, Array, Array]:
        """Refuse: the images |p| >= 2 are not a list with equal weights.

        Raises
        ------
        InputError
            Always; `near` and `replaced` say what to sum.
        """
        raise InputError(
            "domain.sum",
            "'images' or 'truncated' with the paper's engine",
            repr(self.kind),
            f"The exact sum over {domain.kind} images is for the spectral engine.",
        )

    def near(self, domain: AbstractDomain) -> Array:
        """Return the shifts of the images |p| <= 1, (image, 3)."""
        return super().shifts(domain)[1]

    def replaced(self, domain: AbstractDomain, tolerance: float) -> ReplacedImages | None:
        """Return what stands for the images |p| >= 2 to `tolerance`; None in free space.

        Raises
        ------
        InputError
            If more than one direction is periodic.
        """
        lengths = domain.lengths
        if (lengths > 0.0).sum() > 1:
            raise InputError("domain.sum", "one periodic direction", int((lengths > 0.0).sum()))
        if not lengths.any():
            return None
        axis = int(np.argmax(lengths))
        period = float(lengths[axis])
        needed = places_needed(tolerance)
        kinds = sorted(set(needed))
        places, weights = np.zeros((2, len(kinds), 2 * max(kinds)))
        constants = np.empty(len(kinds))
        for r, count in enumerate(kinds):
            p, w = replaced_images(count)
            places[r, : 2 * count] = period * np.concatenate([p, -p])
            weights[r, : 2 * count] = np.concatenate([w, w])
            constants[r] = 2.0 / period * (1.0 + np.sum(w / p))
        rule_at = np.array([kinds.index(n) for n in needed])
        return ReplacedImages(
            axis, period, places, weights, 2 * np.array(kinds), constants, rule_at
        )
