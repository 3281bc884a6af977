"""Whether a run can be trusted: what it measures of its own error, and the limits.

Each quantity, its formula and its limit are in docs/how-to/trust.md. Lengths are looked at after
each step and with the observables; the balances, which need the mobility once more, after a step
now and then. Which steps these are depends on their number alone, and all that is kept goes with
the checkpoints: a run that was stopped says the same as one that was not. The look at a run's last
step is not kept.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Generic

import numpy as np

from stokesfibers.core.arrays import Array
from stokesfibers.core.errors import StokesFibersError
from stokesfibers.core.status import Reason, Status
from stokesfibers.core.variables import lookup
from stokesfibers.io.layout import ArrayLayout
from stokesfibers.observe.balance import Balance, force_error, torque_error
from stokesfibers.problem.engine import PaperEngine
from stokesfibers.problem.problem import Problem
from stokesfibers.run.health_motion import balance_of
from stokesfibers.run.moment import snapshot
from stokesfibers.stepping.base import AbstractStepper, C
from stokesfibers.summation import FastImages

WEIGHED = ("force_error", "torque_error", "energy_error", "motion_error")
"""Observables that are found after a step now and then."""
FIXED_LIMIT = 1e-3
"""Trusted with the high-order engine where steps are fixed and no tolerance is given."""
_FIXED_SPACE = 1e-4  # what nodes are chosen for there
PAPER_LIMITS: Mapping[str, float] = {
    "length_error": 2e-2,  # chords count too
    "force_error": 0.12,
    "torque_error": 1.2e-2,
    "energy_error": 5e-3,
    "motion_error": 1e-2,
    "spatial_error": float("inf"),
    "overlap": 0.0,
}
"""With the paper's engine: up to twice what its coarsest run has (N = 50, mu_bar = 4e5, Fig. 8)."""
_EVERY, _EVERY_OF_SEVERAL = 16, 32  # steps between two that are weighed
_EARLY = (2, 4, 8)
_LEAST_WORK = 1e-6  # of E / L: a run that dissipates less is one in which nothing happens
_HUGE = 1e308  # stands for what is not finite: beyond each limit, and JSON can hold it

_MORE_NODES = (
    "Take more discretization.nodes, or leave them out: the run then adds what shapes ask for"
)
_SMALLER_STEP = "Take a smaller stepping.rtol"
_APART = "Add a steric load, or a stronger one; where fibers overlap the model does not hold"
_HINTS: Mapping[str, tuple[str, str]] = {
    "length_error": ("a fiber changed its length", _SMALLER_STEP),
    "force_error": ("the elastic forces on a fiber do not add up to zero", _MORE_NODES),
    "torque_error": ("the elastic torques on a fiber do not add up to zero", _MORE_NODES),
    "energy_error": ("the balance of power is not kept", _SMALLER_STEP),
    "motion_error": ("the fibers do not move as the equation of motion says", _SMALLER_STEP),
    "spatial_error": ("the nodes do not resolve the shapes", _MORE_NODES),
    "overlap": ("surfaces of fibers overlap", _APART),
}
_FIXED_STEP = "Take a smaller stepping.dt, or give stepping.rtol instead"
_PAPER = "Take more discretization.intervals and a smaller stepping.dt, or engine = 'spectral'"


def limits(problem: Problem) -> dict[str, float]:
    """Return the largest value of each quantity that is trusted."""
    engine = problem.engine
    if isinstance(engine, PaperEngine):
        return dict(PAPER_LIMITS)
    fixed = engine.rtol is None
    found = dict.fromkeys(PAPER_LIMITS, FIXED_LIMIT if fixed else float(engine.rtol or 0.0))
    found["overlap"] = PAPER_LIMITS["overlap"]
    return found | ({"spatial_error": _FIXED_SPACE} if fixed else {})


def health_layout() -> dict[str, ArrayLayout]:
    """Return the arrays that are stored beside the observables of a moment."""
    return {f"observables/{name}": ArrayLayout(lookup("observables", name), ()) for name in WEIGHED}


@dataclass(frozen=True)
class _Sums:
    """Integrals over time so far; `most` is the largest |missing| that there was, `when` its time.

    What the start lacks is held against all that the run dissipates, not against the next to
    nothing that is dissipated until then: there, rounding alone would be beyond a small tolerance.
    """

    missing: float = 0.0
    dissipated: float = 0.0
    off: float = 0.0
    moved: float = 0.0
    most: float = 0.0
    when: float = 0.0


class Health(Generic[C]):
    """Watches a run.

    Parameters
    ----------
    stepper
        Shows the fibers.
    threads
        Threads to use, None for all cores. Results do not depend on it.
    """

    def __init__(self, stepper: AbstractStepper[C], threads: int | None = None) -> None:
        self._stepper = stepper
        self._weigh = balance_of(stepper, threads)
        problem = stepper.problem
        several = len(problem.fibers) > 1 or bool(problem.domain.lengths.any())
        self._every = _EVERY_OF_SEVERAL if several else _EVERY
        self._least = _LEAST_WORK * max(k.rigidity / k.length for k in problem.kinds)
        self._limits = limits(problem)
        longest = max(k.length for k in problem.kinds)
        # Power of the forces that bear a fiber's own motion on an error of the limit in it.
        self._let_pass = self._limits["energy_error"] * problem.drag * longest**3
        self._worst: dict[str, tuple[float, float]] = {}
        self._now = dict.fromkeys(WEIGHED, 0.0)
        self._last: Balance | None = None
        self._sums = _Sums()

    def observed(self, records: Mapping[str, Array]) -> dict[str, Array]:
        """Take note of the observables of a moment, and return what belongs beside them."""
        when = float(records["observables/time"][0])
        self.note("length_error", float(np.max(records["observables/length_error"])), when)
        if "observables/smallest_gap" in records:
            self.note("overlap", max(0.0, -records["observables/smallest_gap"].min().item()), when)
        return {f"observables/{name}": np.array([self._now[name]]) for name in WEIGHED}

    def note(self, quantity: str, value: float, time: float) -> None:
        """Keep the worst value of a quantity and its time; what is not finite is the worst."""
        if self._limits[quantity] == float("inf"):  # not measured with this engine
            return
        size = float(value) if np.isfinite(value) else _HUGE
        if size > self._worst.get(quantity, (0.0, 0.0))[0]:
            self._worst[quantity] = (size, float(time))

    def step(self, carry: C) -> None:
        """Weigh the step behind `carry`, if it is its turn."""
        if not carry.step % self._every or carry.step in _EARLY:
            self._look(carry)

    def _look(self, carry: C) -> None:
        """Weigh the step behind `carry`."""
        try:
            balance = self._weigh(carry)
            moment = snapshot(self._stepper, carry)
            found = float(np.max(force_error(moment))), float(np.max(torque_error(moment)))
        except (StokesFibersError, ArithmeticError, np.linalg.LinAlgError):
            return  # a user's function that fails here fails in the next step, which says so
        if balance is None:
            return
        # As a checkpoint would hold it, so that a run that was stopped goes on with the same.
        balance = Balance(**_finite(vars(balance)))
        sums = _added(self._sums, self._last, balance, let_pass=self._let_pass)
        self._last, self._sums = balance, sums
        work = max(sums.dissipated, self._least)
        self._now = _finite(
            {
                "force_error": found[0],
                "torque_error": found[1],
                "energy_error": abs(sums.missing) / work,
                "motion_error": sums.off / max(1.0, sums.moved),
            }
        )
        if carry.step < _EVERY:  # of the first steps, which start anew, too little is known
            return
        for name in ("force_error", "torque_error", "motion_error"):
            self.note(name, self._now[name], balance.time)
        self._worst["energy_error"] = (_finite(sums.most / work), sums.when)

    def state(self) -> dict[str, Any]:
        """Return what goes with a checkpoint, JSON-ready."""
        last = None if self._last is None else vars(self._last)
        held = {"worst": self._worst, "now": self._now, "last": last, "sums": vars(self._sums)}
        return {name: _finite(value) for name, value in held.items()}

    def recall(self, held: Mapping[str, Any] | None) -> None:
        """Take over the state of a checkpoint; older ones have none."""
        if held is None:
            return
        self._worst = {name: (value, time) for name, (value, time) in held["worst"].items()}
        self._now = dict(held["now"])
        last = held["last"]
        # an older version held no speed
        self._last = None if last is None else Balance(**({"speed": last["pace"]} | last))
        self._sums = _Sums(**held["sums"])
        if "most" not in held["sums"] and self._last is not None:  # of an older version
            self._sums = replace(self._sums, most=abs(self._sums.missing), when=self._last.time)

    def judged(
        self, status: Status, crossings: list[dict[str, Any]], carry: C | None = None
    ) -> Status:
        """Return `status` with whether the run can be trusted, and why not.

        A run that ended gets a last look at `carry`, which leaves no trace: going on from there is
        as if it had not ended. One that failed, or still goes on, is never called trusted.
        """
        ended = status.code in ("done", "interrupted")
        beyond = self._beyond() if carry is None or not ended else self._beyond_with(carry)
        reasons = [*_crossed(crossings), *_summed(self._stepper.problem), *beyond]
        trust = "doubtful" if reasons else "trusted" if ended else ""
        return replace(status, trust=trust, reasons=tuple(reasons))

    def _beyond_with(self, carry: C) -> list[Reason]:
        """Return what is beyond its limit after one more look, which is then forgotten."""
        kept = dict(self._worst), self._now, self._last, self._sums
        if self._last is None or self._last.time != self._stepper.time(carry):
            self._look(carry)
        beyond = self._beyond()
        self._worst, self._now, self._last, self._sums = kept
        return beyond

    def _beyond(self) -> list[Reason]:
        """Return a reason for each quantity beyond its limit, the farthest first."""
        found = []
        beyond = {name: w for name, w in self._worst.items() if w[0] > self._limits[name]}
        for name, (value, time) in beyond.items():
            what, hint = _HINTS[name]
            if name != "overlap":
                hint = self._hint(hint, spoilt="spatial_error" in beyond)
            found.append(Reason(name, value, self._limits[name], time, what, hint))
        far = {r.quantity: r.value / r.limit if r.limit else np.inf for r in found}
        return sorted(found, key=lambda r: (r.quantity != "spatial_error", -far[r.quantity]))

    def _hint(self, hint: str, *, spoilt: bool) -> str:
        engine = self._stepper.problem.engine
        if isinstance(engine, PaperEngine):
            return _PAPER
        if spoilt:  # by too few nodes, as is all the rest
            return _MORE_NODES
        return _FIXED_STEP if engine.rtol is None and hint == _SMALLER_STEP else hint


def _added(sums: _Sums, last: Balance | None, now: Balance, *, let_pass: float) -> _Sums:
    """Return the integrals up to `now`, by the trapezoidal rule.

    To what is dissipated belongs what errors within the limit dissipate, `let_pass` times pace
    squared: in a rigid rotation there is nothing else.
    """
    before = last or replace(now, time=0.0)
    half = 0.5 * (now.time - before.time)
    errors = let_pass * (before.pace * before.pace + now.pace * now.pace)
    missing = _finite(sums.missing + half * (before.residual + now.residual))
    more = abs(missing) > sums.most
    dissipated = abs(before.dissipation) + abs(now.dissipation) + errors
    added = _Sums(
        missing,
        sums.dissipated + half * dissipated,
        sums.off + half * (before.defect + now.defect),
        sums.moved + half * (before.speed + now.speed),
        abs(missing) if more else sums.most,
        now.time if more else sums.when,
    )
    return _Sums(**_finite(vars(added)))


def _crossed(crossings: list[dict[str, Any]]) -> list[Reason]:
    if not crossings:
        return []
    one, other = crossings[0]["fibers"]
    return [
        Reason(
            "crossings",
            float(len(crossings)),
            0.0,
            float(crossings[0]["time"]),
            f"fibers {one} and {other} passed through each other",
            "Add a steric load or take a smaller step; what follows a crossing is not physical",
        )
    ]


def _summed(problem: Problem) -> list[Reason]:
    """Return a reason where sums between fibers are asked to err by more than the run may."""
    images, engine = problem.image_sum, problem.engine
    if not isinstance(images, FastImages) or isinstance(engine, PaperEngine):
        return []
    limit, given = engine.rtol or FIXED_LIMIT, images.tolerance or 0.0
    if given <= limit:
        return []
    what, hint = "the sum between fibers is less accurate", "Leave domain.tolerance out"
    return [Reason("sum_tolerance", given, limit, 0.0, what, hint)]


def _finite(value: Any) -> Any:
    """Return plain JSON values, with what is not finite as the largest number."""
    if isinstance(value, dict):
        return {name: _finite(v) for name, v in value.items()}
    if isinstance(value, tuple | list):
        return [_finite(v) for v in value]
    if not isinstance(value, float):
        return value
    return float(np.nan_to_num(value, nan=_HUGE, posinf=_HUGE, neginf=-_HUGE))
