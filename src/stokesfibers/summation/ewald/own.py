"""Pairs of one filament in the same image: the near part leaves them out, here their far part goes.

The far part sums over all pairs. Within rc it is the polynomials of the near part, beyond rc the
whole kernel; no large term is added and taken off again. Points without a filament are filaments
of one point, whose far part at r = 0 is the self term of the Ewald sum.
"""

from __future__ import annotations

import numpy as np

from stokesfibers.core.arrays import Array
from stokesfibers.core.team import AbstractTeam
from stokesfibers.kernels import ewald as kernels
from stokesfibers.summation.ewald.cloud import Cloud, Integers
from stokesfibers.summation.ewald.near import as_tuples, chunks, cut
from stokesfibers.summation.ewald.near_polynomial import NearPolynomials

CHUNKS = 16


def _members(numbers: Integers, count: int) -> tuple[Integers, Integers]:
    """Return where each filament's points begin, (count + 1,), and the points."""
    known = np.flatnonzero(numbers >= 0)
    members = known[np.argsort(numbers[known], kind="stable")]
    heads = np.concatenate([[0], np.cumsum(np.bincount(numbers[known], minlength=count))])
    return heads.astype(np.int64), members


class OwnPart:
    """The far part of own pairs of one cloud: `load` forces, run all tasks, then `complete`.

    The tasks are those of this rank, `shares` being the ranks' shares of the work.
    """

    def __init__(
        self,
        cloud: Cloud,
        polynomials: NearPolynomials,
        *,
        radius: Array,
        team: AbstractTeam,
        shares: Array,
    ) -> None:
        self._team = team
        count = int(cloud.filaments.max(initial=-1)) + 1
        self._sources, self._targets = cloud.sources, cloud.targets
        self._members = _members(cloud.filaments, count)
        same = cloud.target_filaments is cloud.filaments
        self._theirs = self._members if same else _members(cloud.target_filaments, count)
        self._scale = polynomials.scale
        self._polynomials = as_tuples(polynomials, radius, float)
        d = 0.5 * (radius * self._scale) ** 2
        self._d = np.ascontiguousarray(np.broadcast_to(d, (len(cloud.sources),)))
        work = np.diff(self._members[0]) * (np.diff(self._theirs[0]) + 1.0)
        ranks = cut(work, shares)
        self._edges = chunks(work, ranks, team.rank, CHUNKS)
        self._rows = self._theirs[0][ranks]
        self._force = np.zeros(cloud.sources.shape)

    @property
    def tasks(self) -> int:
        return len(self._edges) - 1 if self._theirs[1].size else 0

    def load(self, force: Array) -> None:
        """Take forces (n, 3), of order one, for the next sum."""
        self._force = force

    def run(self, task: int, out: Array) -> None:
        """Subtract from `out` (m, 3), in the order given, what one task of filaments owes."""
        kernels.own_pairs(
            self._edges[task],
            self._edges[task + 1],
            *self._members,
            *self._theirs,
            self._sources,
            self._targets,
            self._force,
            self._d,
            self._scale,
            self._polynomials,
            out,
        )

    def complete(self, out: Array) -> None:
        """Bring what the other ranks owe into `out`, which holds nothing but this part."""
        if self._team.size > 1:
            members = self._theirs[1]
            rows = out[members]
            self._team.complete(rows, self._rows)
            out[members] = rows
