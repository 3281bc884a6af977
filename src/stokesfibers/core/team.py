"""The processes that share the work on one simulation; alone unless a launcher says otherwise.

Work is cut into contiguous shares by rank. Each rank fills its own rows of an array that all ranks
hold, and `complete` brings in the others'. Nothing is added up across ranks: a number is computed
by one rank from the same operands in the same order, however many ranks there are.
"""

from __future__ import annotations

import abc
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray


def edges_of(count: int, parts: int) -> NDArray[np.int64]:
    """Return where `parts` like shares of `count` things begin, with the end, (parts + 1,)."""
    return np.arange(parts + 1, dtype=np.int64) * count // parts


class AbstractTeam(abc.ABC):
    """The ranks of one simulation. Every rank must call the same methods in the same order.

    Attributes
    ----------
    rank, size
        Number of this process, from 0, and how many there are.
    neighbours
        Ranks that share the cores of this process, itself among them.
    busy
        Whether the other ranks are in the middle of something that needs this one.
    """

    rank: int = 0
    size: int = 1
    neighbours: int = 1
    busy: bool = False

    def share(self, count: int) -> range:
        """Return which of `count` things this rank does."""
        edges = edges_of(count, self.size)
        return range(int(edges[self.rank]), int(edges[self.rank + 1]))

    @abc.abstractmethod
    def complete(self, rows: NDArray, edges: NDArray[np.int64] | None = None) -> None:
        """Fill in the rows of a C-contiguous array that the other ranks did.

        Rank r did rows ``edges[r]`` to ``edges[r + 1]``; its `share` of them if None.
        """

    @abc.abstractmethod
    def copy_from(self, rank: int, values: NDArray) -> None:
        """Overwrite a contiguous array by that of `rank`, on all ranks."""

    @abc.abstractmethod
    def swap(self, other: int, mine: NDArray, theirs: NDArray) -> None:
        """Send `mine` to rank `other`, which does the same, and receive `theirs`."""

    @abc.abstractmethod
    def any(self, flag: bool) -> bool:
        """Return whether the flag is set on any rank."""

    @abc.abstractmethod
    def tell(self, word: Any, arrays: Sequence[NDArray] = ()) -> None:
        """Send something small and float64 arrays from rank 0 to the others, who `hear` it."""

    @abc.abstractmethod
    def hear(self) -> tuple[Any, list[NDArray]]:
        """Return what rank 0 tells."""

    @abc.abstractmethod
    def abort(self, code: int) -> None:
        """End all processes at once."""


class Alone(AbstractTeam):
    """One process, which has nobody to talk to."""

    def complete(self, rows: NDArray, edges: NDArray[np.int64] | None = None) -> None:
        pass

    def copy_from(self, rank: int, values: NDArray) -> None:
        pass

    def swap(self, other: int, mine: NDArray, theirs: NDArray) -> None:  # noqa: ARG002
        raise RuntimeError("there is no other rank")

    def any(self, flag: bool) -> bool:
        return flag

    def tell(self, word: Any, arrays: Sequence[NDArray] = ()) -> None:
        pass

    def hear(self) -> tuple[Any, list[NDArray]]:
        raise RuntimeError("there is no other rank")

    def abort(self, code: int) -> None:
        raise SystemExit(code)


ALONE = Alone()
