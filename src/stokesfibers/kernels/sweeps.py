"""Products of the coupled tension equation and its sweeps (39), for several threads at once.

The influence C has shape (fiber l, m, fiber k, m): one row of numbers per equation. It does not fit
into a cache, so a sweep reads it once: the part that meets tensions of the sweep before is read by
all threads, the part that needs the newest ones by one.
"""

from __future__ import annotations

import numpy as np
from numba import njit

_OPTIONS = {"cache": True, "nogil": True, "fastmath": {"reassoc", "contract", "arcp", "nsz"}}


@njit(**_OPTIONS)
def inverse(matrix):
    """Return the inverse; LinAlgError if singular."""
    return np.linalg.inv(matrix)


@njit(**_OPTIONS)
def later(start, stride, influence, tension, out):
    """Set out[k] = sum over j > k of C_kj T_j for k = start, start + stride, ..."""
    count, m = tension.shape
    rows, flat = influence.reshape(count, m, count * m), tension.reshape(count * m)
    for k in range(start, count, stride):
        for i in range(m):
            row = rows[k, i]
            total = 0.0
            for q in range((k + 1) * m, count * m):
                total += row[q] * flat[q]
            out[k, i] = total


@njit(**_OPTIONS)
def sweep(influence, inverses, known, tension):
    """Set tension[k] = inverse_k (known_k - sum over j < k of C_kj T_j) for k = 0, 1, ...

    Returns the largest change relative to the largest tension of its fiber; it means nothing if
    tensions overflow, which the caller checks: reassociated arithmetic cannot.
    """
    count, m = tension.shape
    rows, flat = influence.reshape(count, m, count * m), tension.reshape(count * m)
    largest = 0.0
    right = np.empty(m)
    for k in range(count):
        for i in range(m):
            row = rows[k, i]
            total = 0.0
            for q in range(k * m):
                total += row[q] * flat[q]
            right[i] = known[k, i] - total
        change, size = 0.0, 0.0
        for i in range(m):
            new = 0.0
            for q in range(m):
                new += inverses[k, i, q] * right[q]
            change = max(change, abs(new - tension[k, i]))
            size = max(size, abs(new))
            tension[k, i] = new
        largest = max(largest, change / size if size > 0.0 else change)
    return largest
