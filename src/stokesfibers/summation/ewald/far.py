"""The far part: sources to modes by a NUFFT, the Green's function, modes to targets by another.

The three real components travel as two complex transforms, ``f_x + i f_y`` and ``f_z``. Each runs
on one thread, side by side: that is faster than threads inside a transform, and the same to the
last bit every time. Of several ranks the first two do one of the components each and swap the
modes; the others take more of the near part (`cost.near_shares`). In a sheared cell the transforms
work in lattice coordinates, where mode numbers are whole; the wavenumbers of the Green's function
are the true ones.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from stokesfibers.core.arrays import Array, as_float
from stokesfibers.core.errors import InputError, MissingExtraError
from stokesfibers.core.parallel import Workers
from stokesfibers.kernels import ewald as kernels
from stokesfibers.summation.ewald.cloud import Cloud, Lattice
from stokesfibers.summation.ewald.green import FarBox, far_box
from stokesfibers.summation.ewald.split import Split

NUFFT_SHARE = 1.0
"""Of the tolerance, what the transforms are asked for; they do several times better."""
_SERIES = 64
_COMPONENTS = 2
_BoxKey = tuple[tuple[float, ...], tuple[int, ...], tuple[bool, ...]]
LEAST_NUFFT_ERROR = 5e-13
SINGLE_TOLERANCE = 9e-5
"""Tolerances from here on are met by transforms in single precision."""
MOST_MODES = 2**28
"""Above it the spectra do not fit in memory: 8 GiB."""


def nufft_library() -> ModuleType:
    """Return ducc0's NUFFT module.

    Raises
    ------
    MissingExtraError
        If it is not installed.
    """
    try:
        import ducc0
    except ImportError as error:
        raise MissingExtraError("ducc0", "fast", "The Ewald sum") from error
    return ducc0.nufft


def box_of(lattice: Lattice, extent: Array, split: Split) -> FarBox:
    """Return the Fourier box; in a sheared cell with the modes along y that the slant needs."""
    box = far_box(lattice.periods, extent, split)
    if lattice.offset == 0.0:
        return box
    steep = float(np.hypot(1.0, lattice.offset / lattice.periods[1]))
    reach = split.k_max * lattice.periods[1] * steep / (2.0 * np.pi)
    modes = box.modes.copy()
    modes[1] = max(modes[1], 2 * (int(reach) + 1))
    return replace(box, modes=modes)


def check_modes(box: FarBox) -> None:
    """Refuse more modes than fit in memory."""
    if np.prod(box.modes.astype(float)) > MOST_MODES:
        raise InputError(
            "rc",
            f"a cut-off that needs at most {MOST_MODES:.1e} Fourier modes",
            f"{np.prod(box.modes.astype(float)):.1e}",
            "Raise rc or the tolerance, or split the cloud.",
        )


def _wavenumbers(count: int, length: float) -> Array:
    return as_float(2.0 * np.pi / length * np.fft.fftfreq(count, 1.0 / count))


@lru_cache(maxsize=8)
def _multiplier_series(split: Split) -> Array:
    """Return the Chebyshev series of gamma in ``2 k^2 / k_max^2 - 1``."""
    y = np.cos(np.pi * (np.arange(_SERIES) + 0.5) / _SERIES)
    gamma = split.multiplier(split.k_max * np.sqrt(0.5 * (1.0 + y)))
    return as_float(np.polynomial.chebyshev.chebfit(y, gamma, _SERIES - 1))


@lru_cache(maxsize=2)
def _weights(split: Split, box: _BoxKey, slant: float, radius: float) -> Array:
    """Return what multiplies the planes 0 <= i < nx/2 of the spectra; kept for the next plan."""
    lengths, modes, periodic = box
    kx, ky, kz = (_wavenumbers(n, v) for n, v in zip(modes, lengths, strict=True))
    half = modes[0] // 2
    out = np.empty((half, *modes[1:]))
    series = _multiplier_series(split)
    for i in range(half):
        kernels.fill_weights(i, kx, ky, kz, slant, split.k_max, series, 0.25 * radius * radius, out)
    x, z = kx[:half, None, None], kz[None, None, :]
    y = ky[None, :, None] - slant * x
    whole = FarBox(np.array(lengths), np.array(modes), np.array(periodic), split.rc, split.k_max)
    out *= whole.green(x, y, z)
    out /= float(np.prod(lengths))
    return out


class FarPart:
    """The far part of one cloud: `spread` tasks, `exchange`, `multiply`, `collect`, `result`.

    The tasks are those of this rank; `exchange` and `result` bring in what other ranks did.

    Attributes
    ----------
    box
        The Fourier box.
    error
        What the transforms are asked for.
    """

    def __init__(
        self, cloud: Cloud, orders: tuple, split: Split, *, radius: Array, workers: Workers
    ) -> None:
        lattice = cloud.lattice
        low, high = cloud.bounds
        self._team = workers.team
        self.box = box_of(lattice, high - low, split)
        check_modes(self.box)
        order, target_order = orders
        self._kind = np.complex64 if split.tolerance >= SINGLE_TOLERANCE else np.complex128
        self.error = max(NUFFT_SHARE * split.tolerance, LEAST_NUFFT_ERROR)
        middle = np.where(lattice.periodic, 0.0, 0.5 * (low + high))
        self._slant = lattice.offset / self.box.lengths[1]
        self._mixed = radius.size > 1 and bool(np.any(radius != radius[0]))
        sets = 4 if self._mixed else 2
        self._crew = min(_COMPONENTS, self._team.size)
        own = range(self._team.rank, sets, self._crew) if self._team.rank < self._crew else range(0)
        self._spreads, self._collects = list(own), [k for k in own if k < _COMPONENTS]
        self._strength = np.zeros((sets, len(order)), self._kind)
        self._found = np.empty((_COMPONENTS, len(target_order)), self._kind)
        self._constant = np.zeros(3)
        self._square = radius[order] ** 2 if self._mixed else None
        if not own:
            return
        self._spectra = np.empty((sets, *self.box.modes), self._kind)
        self._k = [
            _wavenumbers(int(n), float(v))
            for n, v in zip(self.box.modes, self.box.lengths, strict=True)
        ]
        self._weights = self._weights_for(split, 0.0 if self._mixed else float(radius[0]))
        angles = self._angles(cloud.inside[:, order], middle)
        same = cloud.target_inside is cloud.inside
        theirs = angles if same else self._angles(cloud.target_inside[:, target_order], middle)
        # a plan of the library serves one caller at a time, so each transform has its own
        library = nufft_library()
        spreads = len(self._spreads)
        self._plans: list = [None] * (spreads + len(self._collects))

        def make(task: int) -> None:
            self._plans[task] = library.plan(
                nu2u=task < spreads,
                coord=angles if task < spreads else theirs,
                grid_shape=tuple(int(n) for n in self.box.modes),
                epsilon=self.error,
                nthreads=1,
                periodicity=2.0 * np.pi,
                fft_order=True,
            )

        workers.for_each(len(self._plans), make)

    def _weights_for(self, split: Split, radius: float) -> Array:
        key = (
            tuple(map(float, self.box.lengths)),
            tuple(map(int, self.box.modes)),
            tuple(map(bool, self.box.periodic)),
        )
        return _weights(split, key, float(self._slant), radius)

    def _angles(self, points: Array, middle: Array) -> NDArray[np.floating]:
        """Return lattice coordinates of points (3, n) as angles, (n, 3)."""
        relative = points - middle[:, None]
        relative[0] = relative[0] - self._slant * relative[1]
        angles = 2.0 * np.pi * relative / self.box.lengths[:, None]
        kind = np.float32 if self._kind is np.complex64 else np.float64
        return np.ascontiguousarray(angles.T.astype(kind))

    @property
    def spreads(self) -> int:
        """Number of `spread` tasks."""
        return len(self._spreads)

    @property
    def collects(self) -> int:
        """Number of `collect` tasks."""
        return len(self._collects)

    @property
    def planes(self) -> int:
        """Number of `multiply` tasks."""
        return int(self.box.modes[0]) // 2 + 1 if self._spreads else 0

    def load(self, force: Array) -> None:
        """Take sorted forces (n, 3), of order one, for the next sum."""
        self._strength[0].real, self._strength[0].imag = force[:, 0], force[:, 1]
        self._strength[1].real = force[:, 2]
        if self._square is not None:
            self._strength[2:] = self._strength[:2] * self._square
        self._constant = self.box.constant * force.sum(axis=0)

    def spread(self, task: int) -> None:
        """Transform one set of strengths to modes."""
        k = self._spreads[task]
        self._plans[task].nu2u(points=self._strength[k], forward=True, out=self._spectra[k])

    def exchange(self) -> None:
        """Give the modes to the rank that has those of the other component, and take its."""
        if self._spreads and self._crew > 1:
            for k in self._spreads:
                other = k ^ 1
                self._team.swap(1 - self._team.rank, self._spectra[k], self._spectra[other])

    def multiply(self, task: int) -> None:
        """Multiply two planes of modes."""
        kx, ky, kz = self._k
        if self._mixed:
            planes = {task, (-task) % int(self.box.modes[0])}
            for i in planes:
                a, b, second, third = self._spectra
                kernels.add_doublets(i, a, b, second, third, kx, ky, kz, self._slant)
        a, b = self._spectra[:2]
        kernels.multiply_modes(task, a, b, self._weights, kx, ky, kz, self._slant)

    def collect(self, task: int) -> None:
        """Transform modes to one set of values at targets."""
        k = self._collects[task]
        self._plans[self.spreads + task].u2nu(
            grid=self._spectra[k], forward=False, out=self._found[k]
        )

    def result(self) -> Array:
        """Return the far part in sorted order, (m, 3), of all ranks."""
        for k in range(self._crew if self._crew > 1 else 0):
            self._team.copy_from(k, self._found[k])
        found = np.empty((self._found.shape[1], 3))
        found[:, 0], found[:, 1] = self._found[0].real, self._found[0].imag
        found[:, 2] = self._found[1].real
        found += self._constant
        return found
