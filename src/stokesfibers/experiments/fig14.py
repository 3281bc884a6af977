"""Fig. 14 and B.1: eigenvalues lambda_n of (B.5), and where c + lambda_n changes sign, (B.6)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from scipy.special import digamma, eval_legendre

from stokesfibers.experiments.base import Row, Settings
from stokesfibers.slender.mobility import slenderness_constant

if TYPE_CHECKING:
    from matplotlib.figure import Figure

EPSILONS = (1e-2, 1e-3, 1e-4)
PRINTED = {1e-2: 33, 1e-3: 340, 1e-4: 3404}
_LARGEST = 5000
_SAMPLED = (1, 2, 3, 5, 10, 20, 33, 34, 100, 340, 341)


def eigenvalues(n: int) -> np.ndarray:
    """Return lambda_0 ... lambda_n of (B.5): twice the harmonic numbers."""
    return np.concatenate([[0.0], 2.0 * np.cumsum(1.0 / np.arange(1, n + 1))])


def by_quadrature(n: int) -> float:
    """Return -S[P_n](alpha) / P_n(alpha) of (B.3), (B.4), by exact Gauss quadrature.

    On each side of alpha the integrand is a polynomial of degree n - 1.
    """
    alpha = 1.0 - 1.0 / (n + 1.0) ** 2  # near the end P_n is not small
    x, w = np.polynomial.legendre.leggauss(n // 2 + 1)
    total = 0.0
    for end in (-1.0, 1.0):
        points = alpha + 0.5 * (end - alpha) * (x + 1.0)
        change = eval_legendre(n, points) - eval_legendre(n, alpha)
        # d alpha' / |alpha' - alpha| does not know the half-width: it is dx / (x + 1)
        total += float(w @ (change / (x + 1.0)))
    return -total / float(eval_legendre(n, alpha))


def run(settings: Settings) -> xr.Dataset:
    """Return lambda_n by formula, some by quadrature, and the levels -c. Takes no time."""
    return xr.Dataset(
        {
            "eigenvalue": (("n",), eigenvalues(_LARGEST)),
            "by_quadrature": (("sampled",), [by_quadrature(n) for n in _SAMPLED]),
            "level": (("eps",), [-slenderness_constant(eps) for eps in EPSILONS]),
        },
        coords={
            "n": np.arange(_LARGEST + 1),
            "sampled": list(_SAMPLED),
            "eps": list(EPSILONS),
        },
        attrs={"quick": int(settings.quick)},
    )


def _last_negative(data: xr.Dataset, eps: float) -> int:
    """Return the largest n with c + lambda_n < 0."""
    level = float(data["level"].sel(eps=eps))
    return int(np.sum(data["eigenvalue"].to_numpy() < level)) - 1


def figure(data: xr.Dataset) -> Figure:
    """Draw lambda_n against n, the levels -c dashed, and the crossings."""
    from stokesfibers.plot.style import COLUMN, FAINT, INK, PALETTE, new_axes, style

    ax = new_axes(width=COLUMN, height=2.5)
    n = data["n"].to_numpy()[1:]
    with style():
        ax.plot(n, data["eigenvalue"][1:], color=PALETTE[0], label=r"$\lambda_n$, (B.5)")
        ax.plot(
            data["sampled"],
            data["by_quadrature"],
            "o",
            color=PALETTE[0],
            markerfacecolor="white",
            markersize=3.2,
            markeredgewidth=0.7,
            label="by quadrature of (B.3)",
        )
        for eps in EPSILONS:
            level = float(data["level"].sel(eps=eps))
            last = _last_negative(data, eps)
            ax.axhline(level, color=INK, linewidth=0.7, linestyle=(0, (4, 2)), zorder=0)
            ax.plot([last, last], [0.0, level], color=FAINT, linewidth=0.6, zorder=0)
            power = round(np.log10(eps))
            ax.text(1.15, level + 0.25, rf"$-c$, $\varepsilon = 10^{{{power}}}$", fontsize=7.5)
            ax.text(0.93 * last, 0.35, f"{last}", fontsize=7, ha="right")
        ax.set_xscale("log")
        ax.set(xlim=(1.0, _LARGEST), ylim=(0.0, 20.0), xlabel="$n$", ylabel=r"$\lambda_n$")
        key = ax.legend(loc="lower right", bbox_to_anchor=(0.99, 0.11), frameon=True)
        key.get_frame().set(facecolor="white", edgecolor="none", alpha=1.0)
    return ax.figure  # pyright: ignore[reportReturnType]


def check(data: xr.Dataset) -> Sequence[Row]:
    """Compare the crossings with the paper's, and lambda_n with quadrature and asymptote."""
    rows = []
    for eps in EPSILONS:
        last, printed = _last_negative(data, eps), PRINTED[eps]
        quantity = f"largest n with c + lambda_n < 0, eps = {eps:g}"
        rows.append(Row(quantity, last, printed, printed, printed))
    sampled = data["sampled"].to_numpy()
    exact = data["eigenvalue"].to_numpy()
    error = np.abs(data["by_quadrature"].to_numpy() / exact[sampled] - 1.0).max()
    limit = 2.0 * (np.log(_LARGEST) - float(digamma(1.0)))
    return [
        *rows,
        Row("largest relative error of (B.5) against quadrature of (B.3)", error, high=1e-10),
        Row(
            f"lambda_n - 2 (log n + gamma) at n = {_LARGEST}",
            float(exact[-1] - limit),
            0.0,
            0.0,
            2.0 / _LARGEST,
        ),
    ]
