"""All entries of the validation suite, in the order of the tables."""

from __future__ import annotations

from stokesfibers.study.validation import bending, figures, orders, rods, sums
from stokesfibers.study.validation.record import GROUPS, Entry

_ALL = (*rods.ENTRIES, *bending.ENTRIES, *sums.ENTRIES, *orders.ENTRIES, *figures.ENTRIES)

ENTRIES: tuple[Entry, ...] = tuple(
    entry for group in GROUPS for entry in _ALL if entry.group == group
)
"""Every entry. To add one, write its function in a module here and an `Entry` below it."""
