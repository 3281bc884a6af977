"""Fast Ewald sums of Stokeslets and doublets, in free space and with one to three periods."""

from __future__ import annotations

from stokesfibers.summation.ewald.plan import Choice, EwaldSum, Plan
from stokesfibers.summation.ewald.split import Split

__all__ = ["Choice", "EwaldSum", "Plan", "Split"]
