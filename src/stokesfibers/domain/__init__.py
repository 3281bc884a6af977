"""Domains: free space, or periodic in some directions."""

from __future__ import annotations

from stokesfibers.domain.domains import AbstractDomain, Free, Periodic

DOMAINS: dict[str, type[AbstractDomain]] = {d.kind: d for d in (Free, Periodic)}
"""Domains by the kind a case file names."""

__all__ = ["DOMAINS", "AbstractDomain", "Free", "Periodic"]
