"""Backward differentiation formulas on any time points: coefficients and error estimates.

Times run backwards: ``offsets[i] = t_new - t_{n-i} > 0`` for i = 0, 1, ... The formula of order k
takes the derivative of the polynomial through the new point and k old ones; the predictor of degree
k is the polynomial through k + 1 old points. If e is the new value minus its prediction, the local
error of the formula is ``e / (1 + alpha offsets[k])``, alpha its leading coefficient.
"""

from __future__ import annotations

from collections.abc import Sequence

HIGHEST_ORDER = 5
GROWTH = (0.0, 2.0, 1.8, 1.4, 1.25, 1.12)
"""Largest ratio of neighbouring steps for orders 1 ... 5: beyond it the formulas lose stability."""


def value_weights(offsets: Sequence[float], at: float = 0.0) -> list[float]:
    """Return the weights of the polynomial through the points `offsets`, taken at offset `at`."""
    weights = []
    for j, own in enumerate(offsets):
        product = 1.0
        for i, other in enumerate(offsets):
            if i != j:
                product *= (at - other) / (own - other)
        weights.append(product)
    return weights


def extrapolations(offsets: Sequence[float]) -> list[list[float]]:
    """Return the weights of the predictors of degree 0 ... len(offsets) - 1, one list each."""
    weights = [1.0]
    rows = [weights]
    for newest in offsets[1:]:
        last = 1.0
        weights = weights.copy()
        for j, own in enumerate(offsets[: len(weights)]):
            weights[j] *= newest / (newest - own)
            last *= own / (own - newest)
        weights.append(last)
        rows.append(weights)
    return rows


def leading_coefficient(order: int, offsets: Sequence[float]) -> float:
    """Return alpha, the weight of the new value in the formula of `order`, in units of 1/time."""
    return sum(1.0 / offset for offset in offsets[:order])


def derivative_weights(order: int, offsets: Sequence[float]) -> list[float]:
    """Return the weights of the `order` newest old values in the formula; alpha is not among them.

    The polynomials that are 1 at one old point and 0 at the new one have there the slope
    ``-w_j / offsets[j]``, w_j the weights of the predictor of degree order - 1.
    """
    newest = extrapolations(offsets[:order])[-1]
    return [-w / offset for w, offset in zip(newest, offsets, strict=False)]


def predicted_rate_weights(
    order: int, offsets: Sequence[float], predictors: Sequence[Sequence[float]]
) -> list[float]:
    """Return the weights of old values in the x_t that the formula gives to the predicted value.

    Parameters
    ----------
    order
        Of the formula.
    offsets
        Of the old points, order + 1 or more.
    predictors
        Their `extrapolations`.
    """
    alpha = leading_coefficient(order, offsets)
    rate = [alpha * w for w in predictors[order]]
    for j in range(order):
        rate[j] -= predictors[order - 1][j] / offsets[j]
    return rate


def error_factor(order: int, offsets: Sequence[float]) -> float:
    """Return what the new value minus its prediction is multiplied by to give the local error."""
    return 1.0 / (1.0 + leading_coefficient(order, offsets) * offsets[order])
