"""All initial shapes by the kind a case file names."""

from __future__ import annotations

from stokesfibers.fiber.initial import AbstractInitial, FromFile, NearlyStraight, Straight
from stokesfibers.fiber.suspension import Lattice, Suspension

INITIALS: dict[str, type[AbstractInitial]] = {
    i.kind: i for i in (Straight, NearlyStraight, Suspension, Lattice, FromFile)
}
