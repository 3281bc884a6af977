"""Engines as data: which discretisation and time stepper solves a problem, with its parameters."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from stokesfibers.core import checks
from stokesfibers.core.errors import InputError
from stokesfibers.numerics.finite_differences import LEAST_INTERVALS

STEP_PER_SPACING = 1.28
"""dt rate / (h / L) of all the paper's runs."""
BETA_PER_RATE = 20.0
LARGEST_BETA_STEP = 0.5
"""dt beta of the default step; the explicit penalisation is unstable from 2/3 on."""


@dataclass(frozen=True)
class PaperEngine:
    """The paper's scheme: finite differences in space, tension first, semi-implicit BDF2 in time.

    Attributes
    ----------
    intervals
        N.
    dt
        Time step; if None, 1.28 / (N rate), the ratio of the paper's runs, or 1 / (2 beta) if that
        is smaller: the penalisation is unstable above 2 / (3 beta).
    beta
        Penalisation of (14), per unit time; if None, 20 times the flow's rate.
    """

    intervals: int = 100
    dt: float | None = None
    beta: float | None = None
    kind: ClassVar[str] = "paper"
    citation: ClassVar[str] = "Tornberg & Shelley 2004, Section 3"

    @property
    def samples(self) -> int:
        """Equally spaced points that show a fiber's shape: the nodes."""
        return self.intervals + 1

    def __post_init__(self) -> None:
        checks.whole("intervals", self.intervals, LEAST_INTERVALS)
        if self.dt is not None:
            checks.positive("dt", self.dt)
        if self.beta is not None:
            checks.non_negative("beta", self.beta)

    def resolved(self, rate: float) -> PaperEngine:
        """Return the engine with dt and beta set from the flow's `rate` where they are None.

        Raises
        ------
        InputError
            If one is needed and there is no flow to take it from.
        """
        for name in ("dt", "beta"):
            if getattr(self, name) is None and rate == 0.0:
                raise InputError(
                    name, "a value, since there is no flow rate to derive it from", "none"
                )
        beta = self.beta if self.beta is not None else BETA_PER_RATE * rate
        dt = self.dt
        if dt is None:
            dt = STEP_PER_SPACING / (self.intervals * rate)
            if beta > 0.0:
                dt = min(dt, LARGEST_BETA_STEP / beta)
        return replace(self, dt=dt, beta=beta)
