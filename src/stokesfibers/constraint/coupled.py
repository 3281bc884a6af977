"""Tensions of all fibers at once: the coupled system (27), by the sweeps (39) or by GMRES.

    L_l T_l + sum_k C_lk T_k = J_l - Phi_l[bending]

L_l is the single-fiber operator (22), C_lk the influence of the tensions of fiber k. The image
terms k = l are part of C. Both solvers return the same tensions to their tolerance.
"""

from __future__ import annotations

import abc
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from stokesfibers.core import checks
from stokesfibers.core.arrays import Array
from stokesfibers.core.errors import StokesFibersError
from stokesfibers.core.parallel import Workers
from stokesfibers.kernels import sweeps

_TASKS = 8  # parts of a product handed to threads; each starts at another fiber


class TensionError(StokesFibersError):
    """The coupled tension equation could not be solved."""


@dataclass(frozen=True)
class CoupledSystem:
    """The system for the inner tensions of all fibers.

    Attributes
    ----------
    own
        L_l, (fiber, m, m) with m = node - 2.
    influence
        C_lk, (fiber l, m, fiber k, m): one row of numbers per equation.
    right
        Right-hand side, (fiber, m).
    workers
        Threads for products with C. The result does not depend on them.
    """

    own: Array
    influence: Array
    right: Array
    workers: Workers = field(default_factory=lambda: Workers(1))

    def inverses(self) -> Array:
        """Return the inverses of L_l + C_ll, (fiber, m, m); LinAlgError if not finite or singular.

        Each is applied in every sweep, to one vector: a product is faster than two substitutions.
        """
        if not (np.isfinite(self.right).all() and np.isfinite(self.own).all()):
            raise np.linalg.LinAlgError("the tension equation is not finite")
        out = np.empty_like(self.own)

        def fill(k: int) -> None:
            out[k] = sweeps.inverse(self.own[k] + self.influence[k, :, k])

        self.workers.for_each(len(out), fill)
        return out

    def later(self, tension: Array) -> Array:
        """Return sum over j > k of C_kj T_j for all fibers k, (fiber, m)."""
        out = np.empty_like(tension)
        tasks = min(len(out), _TASKS)

        def fill(task: int) -> None:
            sweeps.later(task, tasks, self.influence, tension, out)

        self.workers.for_each(tasks, fill)
        return out

    def others(self, k: int, tension: Array) -> Array:
        """Return sum over j != k of C_kj T_j, (m,)."""
        rows = self.influence[k]
        full = rows.reshape(rows.shape[0], -1) @ tension.ravel()
        return full - rows[:, k] @ tension[k]


class AbstractTensionSolver(abc.ABC):
    """A way to solve the coupled tension equation."""

    kind: ClassVar[str]
    citation: ClassVar[str]

    @abc.abstractmethod
    def solve(self, system: CoupledSystem, start: Array) -> tuple[Array, int]:
        """Return the tensions (fiber, m) and the number of iterations, from a first guess.

        Raises
        ------
        TensionError
            If the tolerance is not met.
        """


@dataclass(frozen=True)
class FixedPoint(AbstractTensionSolver):
    """The sweeps (39): each fiber in turn, with the newest tensions of the others.

    Attributes
    ----------
    tolerance
        On the change in a sweep, relative, in the maximum norm over each fiber.
    most
        Sweeps after which to give up.
    """

    tolerance: float = 1e-6
    most: int = 100
    kind: ClassVar[str] = "fixed_point"
    citation: ClassVar[str] = "Tornberg & Shelley 2004, (39)"

    def __post_init__(self) -> None:
        checks.positive("tolerance", self.tolerance)
        checks.whole("most", self.most, 1)

    def solve(self, system: CoupledSystem, start: Array) -> tuple[Array, int]:
        inverses = system.inverses()
        tension, change, done = start.copy(), np.inf, 0
        for done in range(1, self.most + 1):
            known = system.right - system.later(tension)
            change = sweeps.sweep(system.influence, inverses, known, tension)
            if not np.isfinite(tension).all():  # sweeps that diverge end in overflow
                change = np.inf
                break
            if change < self.tolerance:
                return tension, done
        raise TensionError(
            f"the tension sweeps (39) did not reach {self.tolerance:g} in {done}: "
            f"last change {change:.3g}. Fibers nearly touch; try the krylov solver or a smaller dt"
        )


@dataclass(frozen=True)
class Krylov(AbstractTensionSolver):
    """GMRES on the coupled system, preconditioned by each fiber's own operator.

    Attributes
    ----------
    tolerance
        On the preconditioned residual, relative.
    most
        Iterations after which to give up.
    """

    tolerance: float = 1e-6
    most: int = 200
    kind: ClassVar[str] = "krylov"
    citation: ClassVar[str] = "Saad & Schultz 1986"

    def __post_init__(self) -> None:
        checks.positive("tolerance", self.tolerance)
        checks.whole("most", self.most, 1)

    def solve(self, system: CoupledSystem, start: Array) -> tuple[Array, int]:
        from scipy.sparse.linalg import LinearOperator, gmres  # slow to import

        inverses = system.inverses()
        shape = start.shape

        def apply(flat: Array) -> Array:
            tension = flat.reshape(shape)
            moved = [own @ system.others(k, tension) for k, own in enumerate(inverses)]
            return (tension + np.stack(moved)).ravel()

        right = np.einsum("kij,kj->ki", inverses, system.right)
        count = 0

        def tick(_: float) -> None:
            nonlocal count
            count += 1

        size = (start.size, start.size)
        operator = LinearOperator(size, matvec=apply, dtype=float)  # pyright: ignore[reportCallIssue]
        found, failed = gmres(
            operator,
            right.ravel(),
            x0=start.ravel(),
            rtol=self.tolerance,
            atol=0.0,
            restart=min(self.most, start.size),
            maxiter=1,
            callback=tick,
            callback_type="pr_norm",
        )
        if failed:
            raise TensionError(
                f"GMRES for the tensions did not reach {self.tolerance:g} in {self.most} steps"
            )
        return found.reshape(shape), max(count, 1)


TENSION_SOLVERS: dict[str, type[AbstractTensionSolver]] = {s.kind: s for s in (FixedPoint, Krylov)}
