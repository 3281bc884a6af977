"""Domains: free space, periodic in some directions, or a sheared cell."""

from __future__ import annotations

from stokesfibers.domain.domains import AbstractDomain, Free, Periodic
from stokesfibers.domain.sheared import Sheared

DOMAINS: dict[str, type[AbstractDomain]] = {d.kind: d for d in (Free, Periodic, Sheared)}
"""Domains by the kind a case file names."""

__all__ = ["DOMAINS", "AbstractDomain", "Free", "Periodic", "Sheared"]
