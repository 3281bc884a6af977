"""Tensions of all fibers at once: the coupled system (27), by the sweeps (39) or by GMRES.

    L_l T_l + sum_k C_lk T_k = J_l - Phi_l[bending]

L_l is the single-fiber operator (22), C_lk the influence of the tensions of fiber k. The image
terms k = l are part of C. Both solvers return the same tensions to their tolerance.
"""

from __future__ import annotations

import abc
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from scipy.linalg import lu_factor, lu_solve

from stokesfibers.core import checks
from stokesfibers.core.arrays import Array
from stokesfibers.core.errors import StokesFibersError


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
    """

    own: Array
    influence: Array
    right: Array

    def factors(self) -> list[Any]:
        """Return LU factors of L_l + C_ll; LinAlgError if the system is not finite."""
        if not (np.isfinite(self.right).all() and np.isfinite(self.own).all()):
            raise np.linalg.LinAlgError("the tension equation is not finite")
        return [
            lu_factor(own + self.influence[k, :, k], check_finite=False)
            for k, own in enumerate(self.own)
        ]

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
        factors = system.factors()
        tension, change, sweep = start.copy(), np.inf, 0
        for sweep in range(1, self.most + 1):
            change = 0.0
            for k, factor in enumerate(factors):
                right = system.right[k] - system.others(k, tension)
                new = lu_solve(factor, right, check_finite=False)
                size = np.abs(new).max()
                change = max(change, float(np.abs(new - tension[k]).max() / (size or 1.0)))
                tension[k] = new
            if not np.isfinite(tension).all():  # sweeps that diverge end in overflow
                change = np.inf
                break
            if change < self.tolerance:
                return tension, sweep
        raise TensionError(
            f"the tension sweeps (39) did not reach {self.tolerance:g} in {sweep}: "
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

        factors = system.factors()
        shape = start.shape

        def apply(flat: Array) -> Array:
            tension = flat.reshape(shape)
            moved = [
                lu_solve(f, system.others(k, tension), check_finite=False)
                for k, f in enumerate(factors)
            ]
            return (tension + np.stack(moved)).ravel()

        right = np.stack([lu_solve(f, r) for f, r in zip(factors, system.right, strict=True)])
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
