"""How a run ended, as data: a code, the time it concerns, what went wrong, and what to try.

Beside it stands whether the result can be trusted: what a run measured of its own error, against
limits (`run.health`).
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any, Literal

Code = Literal["running", "done", "interrupted", "failed"]
Trust = Literal["", "trusted", "doubtful"]


@dataclass(frozen=True)
class Reason:
    """Why a result is doubtful: one quantity that is beyond its limit.

    Attributes
    ----------
    quantity
        Its name, as in the documentation.
    value, limit
        The worst value, and what is trusted.
    time
        Simulated time of the worst value.
    what
        One line for people.
    hint
        What to try.
    """

    quantity: str
    value: float
    limit: float
    time: float
    what: str
    hint: str

    def __str__(self) -> str:
        size = f"{self.value:.2g} at t = {self.time:.6g}, trusted up to {self.limit:.2g}"
        return f"{self.what}: {size}. {self.hint}"


@dataclass(frozen=True)
class Status:
    """State of a run.

    Attributes
    ----------
    code
        ``"running"`` (also what a killed run shows), ``"done"``, ``"interrupted"`` (resumable)
        or ``"failed"``.
    time
        Simulated time the status speaks of.
    explanation
        One or two sentences for people.
    hint
        What to try; empty when nothing is wrong.
    trust
        ``"trusted"``, ``"doubtful"``, or empty where the run failed or goes on without a doubt, or
        did not watch itself.
    reasons
        Why it is doubtful; the worst first.
    """

    code: Code
    time: float
    explanation: str = ""
    hint: str = ""
    trust: Trust = ""
    reasons: tuple[Reason, ...] = ()

    @classmethod
    def from_dict(cls, held: dict[str, Any]) -> Status:
        """Return the status that a store holds; older ones lack what came later."""
        reasons = tuple(Reason(**reason) for reason in held.get("reasons", ()))
        return cls(**{**held, "reasons": reasons})

    def to_dict(self) -> dict[str, Any]:
        """Return the status as plain JSON-ready values."""
        reasons = [
            {k: v if not isinstance(v, float) else _plain(v) for k, v in asdict(reason).items()}
            for reason in self.reasons
        ]
        return {**asdict(self), "reasons": reasons}

    @property
    def ok(self) -> bool:
        """True when the run did what was asked."""
        return self.code == "done"

    def __str__(self) -> str:
        parts = [f"{self.code} at t = {self.time:.6g}", self.explanation, self.hint]
        return ". ".join(p.rstrip(".") for p in parts if p)


def _plain(value: float) -> float:
    """Return a number that JSON can hold."""
    return value if math.isfinite(value) else math.copysign(1e308, value)
