"""The far part's Fourier box and multiplier for no to three periodic directions.

The far part is ``u(x) = (1/V) sum_k gamma G (I - kk/k^2) fhat exp(i k.x) + constant sum_j f_j``,
V the volume of the box. With the Stokeslet ``S = (I laplacian - grad grad) B`` all depends on one
scalar: ``G = -k^2 Bhat``. In periodic directions the box is the period and ``G = 8 pi / k^2``. In
free ones B is multiplied by a window that is 1 wherever two points of the cloud and the reach of
the mollifier can go, so that the images which a Fourier series brings along do not matter:

    box = 2 (extent + reach) + transition,   G = FT of -laplacian (B window).

The window is a product over the free directions, so the box follows the cloud and not the ball
about it (for a box: Greengard, Jiang & Zhang, SIAM J. Sci. Comput. 40 (2018) A3733; for the ball:
Vico, Greengard & Ferrando, J. Comput. Phys. 323 (2016) 191). Theory page 'Ewald sums'.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import ceil
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.fft import next_fast_len

from stokesfibers.core.arrays import Array
from stokesfibers.core.errors import InputError
from stokesfibers.summation.ewald.green_table import Cell, tabulate
from stokesfibers.summation.ewald.green_window import PHASE

_LATTICE_SLACK = 1e-6  # how far from a mode, in modes, a wavenumber may be


class FarSplit(Protocol):
    """What is asked of a split: the reach of its mollifier and the end of its spectrum."""

    @property
    def rc(self) -> float: ...

    @property
    def k_max(self) -> float: ...


@dataclass(frozen=True, eq=False)
class FarBox:
    """Box, modes and Green's function of the far part.

    Velocities are times 8 pi mu. What a net force does, F = sum_j f_j:

    - three periodic directions: the mean flow is zero, a uniform pressure gradient bears F;
    - two, with the normal z and the area A of the cell: far from the points the velocity is
      ``-(4 pi / A) |z| F`` along the planes, symmetric about them, and zero along z, where a
      pressure difference bears F;
    - one, with the period d along a: ``sum_p S(r + p d a)`` less ``(I + aa) / |p d|`` for each
      p != 0. It grows like the logarithm of the distance: callers refuse a net force or say so;
    - none: the sum as it is.

    Attributes
    ----------
    lengths
        Sides of the Fourier box, (3,): the period, or what a free direction needs.
    modes
        Numbers of modes, (3,): even, with small prime factors. Those with
        ``|m| <= modes/2 - 1`` hold the whole sphere ``|k| <= k_max``.
    periodic
        Which directions are periodic, (3,).
    reach
        Beyond it the mollifier is nothing: rc of the split.
    k_max
        End of the spectrum.
    """

    lengths: Array
    modes: NDArray[np.intp]
    periodic: NDArray[np.bool_]
    reach: float
    k_max: float

    @cached_property
    def _tabulated(self) -> tuple[Array, Array]:
        """The table and the constant, made when first asked for and kept with the box."""
        lengths = tuple(float(v) for v in self.lengths)
        periodic = tuple(bool(v) for v in self.periodic)
        modes = tuple(int(v) for v in self.modes)
        return tabulate(Cell(lengths, modes, periodic, self.reach, self.k_max))

    @property
    def constant(self) -> Array:
        """What times sum_j f_j is to be added to the Fourier sum, per direction, (3,)."""
        return np.zeros(3) if self.periodic.all() else self._tabulated[1]

    def green(self, kx: ArrayLike, ky: ArrayLike, kz: ArrayLike) -> Array:
        """Return G at wavenumbers that broadcast against each other; zero at k = 0.

        Without a free direction any wavenumbers will do, those of a sheared cell among them.
        Otherwise they are modes of the box, with ``|m| <= modes / 2``, from a table that is
        made at the first call.

        Raises
        ------
        InputError
            If there is a free direction and a wavenumber is not a mode of the box.
        """
        k = [np.asarray(v, dtype=float) for v in (kx, ky, kz)]
        if self.periodic.all():
            k2 = k[0] ** 2 + k[1] ** 2 + k[2] ** 2
            return np.divide(8.0 * np.pi, k2, out=np.zeros_like(k2), where=k2 > 0.0)
        at = []
        for axis, values in enumerate(k):
            exact = np.abs(values) * self.lengths[axis] / (2.0 * np.pi)
            mode = np.rint(exact)
            off = np.abs(exact - mode).max(initial=0.0)
            if not off <= _LATTICE_SLACK or mode.max(initial=0.0) > self.modes[axis] // 2:
                expected = f"modes of a box of {self.lengths[axis]:.6g} up to {self.modes[axis]}/2"
                raise InputError(
                    f"wavenumbers[{axis}]", expected, f"one off by {off:.3g} or beyond"
                )
            at.append(mode.astype(np.intp))
        return self._tabulated[0][at[0], at[1], at[2]]


def even_fast_length(least: int) -> int:
    """Return the smallest even length >= `least` that an FFT likes (factors up to 11)."""
    size = max(2, least)
    while size % 2 or next_fast_len(size) != size:
        size += 1
    return size


def far_box(periods: ArrayLike, extent: ArrayLike, split: FarSplit) -> FarBox:
    """Return the box for points that lie within `extent` of each other. Cheap: no table is made.

    In free directions the box is as large as its number of modes allows, so that boxes, and the
    tables of `FarBox.green`, stay the same while a cloud grows or shrinks a little.

    Parameters
    ----------
    periods
        Period along x, y, z, (3,); infinite for a free direction.
    extent
        Size of what encloses sources and targets along x, y, z, (3,); where periodic, not used.
    split
        Gives rc and k_max, both positive.

    Raises
    ------
    InputError
        If a period is not positive, or the extent of a free direction not finite and >= 0.
    """
    period, size = np.array(periods, dtype=float), np.array(extent, dtype=float)
    if period.shape != (3,) or not np.all(period > 0.0):
        raise InputError("periods", "three lengths > 0, inf for a free direction", periods)
    periodic = np.isfinite(period)
    if size.shape != (3,) or not np.all(np.isfinite(size[~periodic]) & (size[~periodic] >= 0.0)):
        raise InputError("extent", "three lengths >= 0, finite where free", extent)
    reach, k_max = float(split.rc), float(split.k_max)
    free = 2.0 * (size + reach) + PHASE / k_max
    lengths = np.where(periodic, period, free)
    modes = np.array([even_fast_length(ceil(k_max * v / np.pi) + 1) for v in lengths])
    # mode n/2, which has no partner, stays just beyond k_max
    lengths[~periodic] = np.pi * (modes[~periodic] - 1) / k_max
    return FarBox(lengths, modes, periodic, reach, k_max)
