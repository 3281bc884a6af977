"""How a run ended, as data: a code, the time it concerns, what went wrong and what to try."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Literal

Code = Literal["running", "done", "interrupted", "failed"]


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
    """

    code: Code
    time: float
    explanation: str = ""
    hint: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Return the status as plain JSON-ready values."""
        return asdict(self)

    @property
    def ok(self) -> bool:
        """True when the run did what was asked."""
        return self.code == "done"

    def __str__(self) -> str:
        parts = [f"{self.code} at t = {self.time:.6g}", self.explanation, self.hint]
        return ". ".join(p.rstrip(".") for p in parts if p)
