"""Slow, obvious twins of the search for near segments."""

from __future__ import annotations

from itertools import product

import numpy as np

from stokesfibers.core.segments import segment_distances
from stokesfibers.domain.domains import AbstractDomain


def closest(x: np.ndarray, radii: np.ndarray, domain: AbstractDomain) -> tuple[float, float]:
    """Return the least distance and gap over all pairs of strange segments; x (fiber, node, 3)."""
    start, along = x[:, :-1], np.diff(x, axis=1)
    middle = start + 0.5 * along
    thick = np.maximum(radii[:, 1:], radii[:, :-1])
    distance, gap = np.inf, np.inf
    for (k, m), i in product(product(range(len(x)), repeat=2), range(start.shape[1])):
        plain = middle[k, i] - middle[m]
        shift = domain.nearest_image(plain) - plain
        strange = np.any(np.abs(shift) > 1e-9, axis=1) | (k != m)
        if k > m or not strange.any():
            continue
        found = segment_distances(
            start[k, i], along[k, i], start[m, strange] - shift[strange], along[m, strange]
        )
        distance = min(distance, float(found.min()))
        gap = min(gap, float((found - thick[k, i] - thick[m, strange]).min()))
    return distance, gap
