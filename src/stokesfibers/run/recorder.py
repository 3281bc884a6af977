"""Collects what is due and hands it to the sink: records first, then the commit."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, Protocol

from stokesfibers.core.status import Status
from stokesfibers.domain.crossings import Crossing
from stokesfibers.io.checkpoint import Checkpoint
from stokesfibers.run.layout import (
    OutputPoints,
    Records,
    observable_records,
    step_records,
    trajectory_records,
)
from stokesfibers.run.moment import snapshot
from stokesfibers.run.schedule import Schedule, is_due
from stokesfibers.stepping.paper import Carry, PaperStepper
from stokesfibers.stepping.report import StepReport


class Sink(Protocol):
    """Where records go: a store on disk or memory."""

    def set_attributes(self, attributes: Mapping[str, Any]) -> None:
        """Set attributes of the run; they count from the next commit on."""
        ...

    def append(self, records: Records) -> None:
        """Add records; they count from the next commit on."""
        ...

    def commit(self, status: Mapping[str, Any], checkpoint: Checkpoint | None = None) -> None:
        """Make everything appended valid."""
        ...


class Recorder:
    """Records a run on its schedule.

    Parameters
    ----------
    sink
        Where the records go.
    stepper
        Gives times and discretised fibers.
    schedule
        What is recorded when.

    Attributes
    ----------
    committed
        Simulated time of the last commit.
    crossings
        Pairs of fibers that passed through each other, with the time.
    """

    def __init__(self, sink: Sink, stepper: PaperStepper, schedule: Schedule) -> None:
        self._sink = sink
        self._stepper = stepper
        self._schedule = schedule
        self._points = OutputPoints(schedule.points)
        self._reports: list[StepReport] = []
        self._saved = 0.0  # time of the last checkpoint
        self.committed = 0.0
        self.crossings: list[dict[str, Any]] = []

    def start(self, carry: Carry) -> None:
        """Record the initial state and commit it."""
        moment = snapshot(self._stepper, carry)
        self._sink.append(trajectory_records(moment, self._points))
        self._sink.append(observable_records(moment))
        self.commit(carry, Status("running", moment.time))

    def step(self, carry: Carry, report: StepReport) -> None:
        """Record what became due in the step that led to `carry`."""
        self._reports.append(report)
        before, now = self._stepper.time(carry.step - 1), self._stepper.time(carry.step)
        schedule = self._schedule
        observe = is_due(schedule.observables_interval, before, now)
        place = is_due(schedule.positions_every, before, now)
        if not (observe or place):
            return
        moment = snapshot(self._stepper, carry)
        if observe:
            self._sink.append(observable_records(moment))
        if place:
            self._sink.append(trajectory_records(moment, self._points))
            due = is_due(schedule.checkpoint_interval, self._saved, now)
            self.commit(carry if due else None, Status("running", now))

    def recall(self, crossings: str, *, until: float) -> None:
        """Take over the crossings that a stopped run had noted up to time `until`."""
        self.crossings = [c for c in json.loads(crossings) if c["time"] <= until * (1.0 + 1e-9)]

    def note_crossings(self, found: tuple[Crossing, ...], report: StepReport) -> None:
        """Keep which fibers passed through each other in a step, and when."""
        for c in found:
            when = report.time - (1.0 - c.fraction) * report.step_size
            self.crossings.append({"time": when, "fibers": [c.first, c.second]})
        if found:
            self._sink.set_attributes({"crossings": json.dumps(self.crossings)})

    def commit(self, carry: Carry | None, status: Status) -> None:
        """Commit all records, with `carry` as checkpoint unless None."""
        if self._reports:
            self._sink.append(step_records(self._reports))
            self._reports = []
        checkpoint = None
        if carry is not None:
            checkpoint = Checkpoint(carry.arrays(), {"step": carry.step})
        self._sink.commit(status.to_dict(), checkpoint)
        self.committed = status.time
        if carry is not None:
            self._saved = status.time
