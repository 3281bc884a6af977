"""A smooth window, and cosine transforms of even functions times it.

The window is 1 up to `flat`, 0 beyond `flat + width`, and between them the integral of
Kaiser's bump ``exp(b sqrt(1 - u^2))``: with ``b = k_max width / 2`` its spectrum has fallen by
exp(-b) at k_max. Functions are given at even Chebyshev nodes, the positive half of those of a
polynomial of twice the degree.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.polynomial.legendre import leggauss

from stokesfibers.core.arrays import Array

PHASE = 20.0
"""k_max times the width of the transition; measured: less costs digits, more only modes."""
_TRANSITION_RULE = 80
_PANEL_RULE = 32
_PANEL_PHASE = 24.0


@cache
def _transition() -> tuple[Array, Array, Array]:
    """Return places in (0, 1) across the transition, weights of the integral, and the window."""
    z, w = leggauss(_TRANSITION_RULE)
    half = 0.5 * np.pi
    # u = sin(angle) takes the square roots at both ends of the bump away
    angle = half * z
    rest = 0.5 * (half - angle)
    inner = angle[:, None] + rest[:, None] * (1.0 + z)
    bump = np.exp(0.5 * PHASE * (np.cos(inner) - 1.0)) * np.cos(inner)
    whole = np.exp(0.5 * PHASE * (np.cos(angle) - 1.0)) * np.cos(angle)
    value = rest * (bump @ w) / (half * (whole @ w))
    return 0.5 * (1.0 + np.sin(angle)), 0.5 * half * np.cos(angle) * w, value


def even_nodes(count: int, end: float) -> Array:
    """Return the positive Chebyshev nodes, (count,), of even functions on [-end, end]."""
    return end * np.cos((np.arange(count) + 0.5) * np.pi / (2 * count))


def _cardinal(count: int, u: Array) -> Array:
    """Return the even polynomials that are 1 at one node each, at u in [-1, 1], (u, count)."""
    m = np.arange(count)
    to_series = np.cos(np.outer((m + 0.5) * np.pi / count, m)) * (2.0 / count)
    to_series[:, 0] *= 0.5
    return np.cos(np.outer(2.0 * np.arccos(u), m)) @ to_series.T


def windowed_transform(k: Array, flat: float, width: float, count: int) -> Array:
    """Return the matrix that takes values at even nodes to the cosine transform, (k, count).

    The transform is ``int f(x) window(x) cos(k x) dx`` over the whole line; the nodes are those of
    ``even_nodes(count, flat + width)``.
    """
    panels = max(1, int(np.ceil(float(k.max(initial=0.0)) * flat / _PANEL_PHASE)))
    z, w = leggauss(_PANEL_RULE)
    half = 0.5 * flat / panels
    inside = (half * (2.0 * np.arange(panels)[:, None] + 1.0 + z)).ravel()
    place, weight, window = _transition()
    x = np.concatenate([inside, flat + width * place])
    rule = 2.0 * np.concatenate([np.tile(half * w, panels), width * weight * window])
    return (np.cos(np.outer(k, x)) * rule) @ _cardinal(count, x / (flat + width))
