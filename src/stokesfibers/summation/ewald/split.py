"""A Stokeslet as a smooth far part and a near part that ends at rc.

With an even mollifier g(k), g(0) = 1, and ``Phi'(r) = (2/pi) int_0^inf cos(k r) g dk``,
``Phi(0) = 0``, the far part is ``(I laplacian - grad grad) B`` with B' = Phi, that is

    S_far(r) = [(Phi + r Phi') I + (Phi - r Phi') rr] / r,  spectrum gamma 8 pi / k^2 (I - kk),
    gamma = g - (k/2) g',   S_far(0) = 2 Phi'(0) I,

where the dyads rr and kk are of unit vectors. Near part: S - S_far. The doublet is half the
Laplacian of S, so ``(a^2/2) D`` multiplies the spectrum by ``-a^2 k^2 / 4`` and has
``(5/6) a^2 Phi'''(0) I`` at r = 0. Sources: Hasimoto 1959 for the Gaussian; arXiv 2509.21471 for
prolate functions in Ewald sums. Theory page 'Ewald sums'.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import spherical_jn

from stokesfibers.core import checks
from stokesfibers.core.arrays import Array
from stokesfibers.summation.ewald.accuracy import bandwidth_for, check_tolerance
from stokesfibers.summation.ewald.prolate import prolate_series, prolate_values

_RULE = 80  # nodes that integrate the mollifier to rounding


@dataclass(frozen=True)
class Split:
    """A mollifier with its cut-offs.

    Attributes
    ----------
    kind
        ``"prolate"`` or ``"gaussian"``.
    tolerance
        Relative rms error of the whole sum it is made for.
    rc
        Beyond it the near part is left out, in units of length.
    k_max
        K: beyond it the far multiplier is left out; its product with rc is the band-width c.
    """

    kind: str
    tolerance: float
    rc: float
    k_max: float

    @classmethod
    def prolate(cls, tolerance: float, rc: float, *, bandwidth: float | None = None) -> Split:
        """Return the split ``g(k) = psi_c(k / K)``, c = K rc from the tolerance unless given."""
        return cls._made("prolate", tolerance, rc, bandwidth=bandwidth)

    @classmethod
    def gaussian(cls, tolerance: float, rc: float, *, bandwidth: float | None = None) -> Split:
        """Return Hasimoto's ``g(k) = exp(-k^2 / (4 xi^2))`` with ``2 xi^2 rc^2 = K rc``."""
        return cls._made("gaussian", tolerance, rc, bandwidth=bandwidth)

    @classmethod
    def _made(cls, kind: str, tolerance: float, rc: float, *, bandwidth: float | None) -> Split:
        check_tolerance(checks.positive("tolerance", tolerance))
        rc = checks.positive("rc", rc)
        if bandwidth is None:
            bandwidth = bandwidth_for(kind, tolerance)
        return cls(kind, tolerance, rc, checks.positive("bandwidth", bandwidth) / rc)

    @property
    def bandwidth(self) -> float:
        """c = K rc."""
        return self.k_max * self.rc

    @property
    def _rate(self) -> float:
        """xi of the Gaussian."""
        return float(np.sqrt(0.5 * self.k_max / self.rc))

    def mollifier(self, k: Array) -> Array:
        """Return g at wavenumbers k >= 0, any shape; zero beyond K."""
        k = np.asarray(k, dtype=float)
        if self.kind == "gaussian":
            g = np.exp(-((0.5 * k / self._rate) ** 2))
        else:
            g = prolate_values(prolate_series(self.bandwidth), np.minimum(k / self.k_max, 1.0))
        return np.where(k <= self.k_max, g, 0.0)

    def multiplier(self, k: Array) -> Array:
        """Return gamma = g - (k/2) g' at wavenumbers k >= 0, any shape; zero beyond K."""
        k = np.asarray(k, dtype=float)
        if self.kind == "gaussian":
            x2 = (0.5 * k / self._rate) ** 2
            gamma = np.exp(-x2) * (1.0 + x2)
        else:
            series, x = prolate_series(self.bandwidth), np.minimum(k / self.k_max, 1.0)
            gamma = prolate_values(series, x) - 0.5 * x * prolate_values(series, x, 1)
        return np.where(k <= self.k_max, gamma, 0.0)

    def slope(self, r: Array) -> Array:
        """Return Phi' at distances 0 <= r <= rc, any shape, per length."""
        r = np.asarray(r, dtype=float)
        if self.kind == "gaussian":
            return 2.0 * self._rate / np.sqrt(np.pi) * np.exp(-((self._rate * r) ** 2))
        series = prolate_series(self.bandwidth)
        z, w = np.polynomial.legendre.leggauss(_RULE)
        whole = 0.5 * (w @ prolate_values(series, 0.5 * (z + 1.0)))
        return prolate_values(series, r / self.rc) / (self.rc * whole)

    def mean_slope(self, r: Array, order: int = 0) -> Array:
        """Return Phi / r, the mean of Phi' over [0, r], or its derivative of `order` by r^2.

        At 0 < r <= rc, any shape. Derivatives are taken under integrals, so no digits are lost:
        for the prolate split ``(d / d r^2) j_n(k r) / (k r)^n = -(k^2 / 2) j_(n+1) / (k r)^(n+1)``
        over its spectrum, which has the same shape.
        """
        r = np.asarray(r, dtype=float)
        z, w = np.polynomial.legendre.leggauss(_RULE)
        z, w = 0.5 * (z + 1.0), 0.5 * w
        if self.kind == "gaussian":
            mean = np.tensordot(self.slope(r[..., None] * z), w * z ** (2 * order), axes=1)
            return mean * (-(self._rate**2)) ** order
        spectrum = w * prolate_values(prolate_series(self.bandwidth), z)
        phase = self.k_max * r[..., None] * z
        waves = spherical_jn(order, phase) / phase**order * (-0.5 * (self.k_max * z) ** 2) ** order
        return np.tensordot(waves, spectrum, axes=1) / spectrum.sum() * self.slope(np.zeros(()))

    def at_origin(self, radius: float = 0.0) -> float:
        """Return s with ``S_far + (a^2/2) D_far = s I`` at r = 0 for a = `radius`.

        ``s = 2 Phi'(0) + (5/6) a^2 Phi'''(0)``: what the far part gives each point from itself.
        """
        if self.kind == "gaussian":
            third = -2.0 * self._rate**2 * self.slope(np.zeros(()))
        else:
            series = prolate_series(self.bandwidth)
            ratio = prolate_values(series, np.zeros(()), 2) / self.rc**2
            third = ratio * self.slope(np.zeros(()))
        return float(2.0 * self.slope(np.zeros(())) + 5.0 / 6.0 * radius**2 * third)
