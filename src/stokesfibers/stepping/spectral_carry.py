"""What a spectral step starts from: the history of modes, the next step, and nothing else."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

import numpy as np

from stokesfibers.core.arrays import Array
from stokesfibers.numerics import bdf

DEPTH = bdf.HIGHEST_ORDER + 2
"""States in the history: six for the formulas and the estimates, one more to interpolate."""


@dataclass(frozen=True)
class Carry:
    """Everything the next step needs; newest state first.

    Attributes
    ----------
    step
        Number of steps taken.
    times
        Of the states in the history, (DEPTH,).
    modes
        Position modes for unit length, (fiber, DEPTH, 3, N).
    tensions
        Tension modes for unit length and rigidity, (fiber, DEPTH, N - 1).
    next_size
        Length of the next try, (1,).
    counters
        Order of the next try, order of the last step, states known, steps since the order changed,
        tries rejected so far; (5,), whole numbers.
    ratio
        Largest ratio of the kernel's series in the last step, (fiber,); see `shape_free`.
    """

    step: int
    times: Array
    modes: Array
    tensions: Array
    next_size: Array
    counters: Array
    ratio: Array

    @classmethod
    def restored(cls, step: int, arrays: Mapping[str, Array]) -> Carry:
        """Return the carry of `step` from the arrays of a checkpoint."""
        return cls(step=step, **arrays)

    def arrays(self) -> dict[str, Array]:
        """Return all arrays by name, for a checkpoint."""
        return {f.name: getattr(self, f.name) for f in fields(self) if f.name != "step"}

    @property
    def time(self) -> float:
        """Time of the newest state."""
        return float(self.times[0])

    def resized(self, nodes: int) -> Carry:
        """Return the carry on another number of nodes: modes are appended as zeros, or dropped.

        Appending changes no shape and no tension.
        """
        return replace(
            self, modes=_resized(self.modes, nodes), tensions=_resized(self.tensions, nodes - 1)
        )

    @property
    def known(self) -> int:
        """States in the history that are filled."""
        return int(self.counters[2])


@dataclass(frozen=True)
class State:
    """Position and tension modes at one time: (fiber, 3, N) and (fiber, N - 1)."""

    modes: Array
    tensions: Array


def combined(weights: list[float] | Array, history: Array) -> Array:
    """Return the sum of `weights` times the newest states of a history (fiber, DEPTH, ...)."""
    flat = history.reshape(*history.shape[:2], -1)[:, : len(weights)]
    return (np.asarray(weights) @ flat).reshape(history.shape[0], *history.shape[2:])


def pushed(newest: Array, history: Array) -> Array:
    """Return a history with `newest` in front and the oldest state dropped."""
    return np.concatenate([newest[:, None], history[:, :-1]], axis=1)


def _resized(modes: Array, count: int) -> Array:
    out = np.zeros((*modes.shape[:-1], count))
    kept = min(count, modes.shape[-1])
    out[..., :kept] = modes[..., :kept]
    return out
