"""External forces on the fibers, per length, one kind per file."""

from __future__ import annotations

from stokesfibers.load.base import AbstractLoad, LoadedState, NoLoad
from stokesfibers.load.gravity import Gravity
from stokesfibers.load.steric import StericRepulsion
from stokesfibers.load.user import UserLoad, load_user_load

LOADS: dict[str, type[AbstractLoad]] = {
    load.kind: load for load in (NoLoad, StericRepulsion, Gravity)
}
"""Loads by the kind a case file names, but for ``"python"``, which runs a file."""

__all__ = [
    "LOADS",
    "AbstractLoad",
    "Gravity",
    "LoadedState",
    "NoLoad",
    "StericRepulsion",
    "UserLoad",
    "load_user_load",
]
