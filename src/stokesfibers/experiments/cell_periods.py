"""Averages over the periods of suspensions in oscillating shear, with errors from their fibers.

Each fiber's own average over a period is a sample: their scatter gives the error of the mean.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi

import numpy as np
import xarray as xr

from stokesfibers.core.arrays import Array
from stokesfibers.experiments.sheared_cells import CellRun, dilute_stress, stresses

PERIOD = 25.6
"""Of the paper's oscillating shear (section 4.2), over its largest rate."""
BENT = 0.9
"""A fiber whose ends come nearer than this share of its length counts as bent."""


@dataclass(frozen=True)
class Periods:
    """Averages of runs that differ by their seed alone, over mu times the largest rate.

    Attributes
    ----------
    mean
        Viscosity and N_1 over each period, (2, period).
    error
        One standard error: the scatter of all fibers' own averages.
    alone
        The same over the first period of straight fibers that do not feel each other, (2,).
    bent
        Share of the fibers that were bent at some time.
    time, n1
        N_1 against time, mean of the runs, (time,).
    """

    mean: Array
    error: Array
    alone: Array
    bent: float
    time: Array
    n1: Array

    @classmethod
    def of(cls, trees: Sequence[xr.DataTree], runs: Sequence[CellRun]) -> Periods:
        """Return the averages of finished runs."""
        series = [stresses(tree, run) for tree, run in zip(trees, runs, strict=True)]
        time = series[0][0]
        each = [_of_fibers(tree, run) for tree, run in zip(trees, runs, strict=True)]
        samples = np.concatenate([over_periods(time, one) for one in each], axis=1)
        count = samples.shape[1]
        first = [
            over_periods(time, dilute_stress(tree, run, time)[:2])[:, 0]
            for tree, run in zip(trees, runs, strict=True)
        ]
        return cls(
            mean=np.mean([over_periods(time, values[:2]) for _, values in series], axis=0),
            error=np.std(samples, axis=1, ddof=1) * runs[0].count / np.sqrt(count),
            alone=np.mean(first, axis=0),
            bent=float(np.mean([_bent(tree) for tree in trees])),
            time=time,
            n1=np.mean([values[1] for _, values in series], axis=0),
        )


def over_periods(time: Array, values: Array) -> Array:
    """Return viscosity and N_1 over each whole period.

    Parameters
    ----------
    time
        (time,), evenly spaced, a whole number of them in a period.
    values
        Sigma_12 and N_1, (2, ..., time).

    Returns
    -------
    Array
        (2, ..., period); sums over a period are the trapezoidal rule, for what is periodic.
    """
    each = round(PERIOD / (time[1] - time[0]))
    count = (len(time) - 1) // each
    weights = np.stack([2.0 * np.sin(2.0 * pi * time / PERIOD), np.ones_like(time)])
    weighted = values * weights.reshape(2, *[1] * (values.ndim - 2), -1)
    means = 0.5 * (weighted[..., :-1] + weighted[..., 1:])[..., : count * each]
    return means.reshape(*values.shape[:-1], count, each).mean(axis=-1)


def _of_fibers(tree: xr.DataTree, run: CellRun) -> Array:
    """Return Sigma_12 and N_1 of each fiber per volume over mu rate, (2, fiber, time)."""
    own = tree["observables"]["fiber_stress"].to_numpy()
    own = np.moveaxis(own, 0, 1) / (run.mu_bar / (8.0 * pi) * run.side**3)
    return np.stack([own[..., 0, 1], own[..., 0, 0] - own[..., 1, 1]])


def _bent(tree: xr.DataTree) -> float:
    apart = np.linalg.norm(tree["observables"]["end_to_end"].to_numpy(), axis=-1)
    return float(np.mean(apart.min(axis=0) < BENT))
