"""Collects what is due and hands it to the sink: records first, then the commit."""

from __future__ import annotations

import json
from collections.abc import Mapping
from time import monotonic
from typing import Any, Generic, Protocol

import numpy as np

from stokesfibers.core.status import Status
from stokesfibers.domain.crossings import Crossing
from stokesfibers.io.checkpoint import Checkpoint
from stokesfibers.observe.snapshot import Snapshot
from stokesfibers.run.health import Health
from stokesfibers.run.layout import (
    OutputPoints,
    Records,
    observable_records,
    step_records,
    together,
    trajectory_records,
)
from stokesfibers.run.moment import snapshot
from stokesfibers.run.schedule import Schedule, due_times, is_due
from stokesfibers.stepping.base import AbstractStepper, C
from stokesfibers.stepping.report import StepReport

LEAST_COMMIT_SECONDS = 0.5
"""Of wall time between commits, each of which replaces some forty files."""
MOST_COMMIT_SECONDS = 20.0
"""Of wall time after which a run is stored though nothing became due: a kill loses no more."""


class Sink(Protocol):
    """Where records go: a store on disk or memory."""

    @property
    def names(self) -> frozenset[str]:
        """What can be appended, as ``"group/name"``; stores of older versions hold less."""
        ...

    def set_attributes(self, attributes: Mapping[str, Any]) -> None:
        """Set attributes of the run; they count from the next commit on."""
        ...

    def append(self, records: Records) -> None:
        """Add records; they count from the next commit on."""
        ...

    def commit(self, status: Mapping[str, Any], checkpoint: Checkpoint | None = None) -> None:
        """Make everything appended valid."""
        ...


class Recorder(Generic[C]):
    """Records a run on its schedule.

    Parameters
    ----------
    sink
        Where the records go.
    stepper
        Shows the fibers at a time.
    schedule
        What is recorded when.
    health
        Watches the run's own error.
    recorded
        Simulated time up to which everything due has been recorded.

    Attributes
    ----------
    recorded
        As given, moved on by each step.
    committed
        Simulated time of the last commit.
    crossings
        Pairs of fibers that passed through each other, with the time.
    spatial_error
        Largest error through lack of nodes that a step reported.
    """

    def __init__(
        self,
        sink: Sink,
        stepper: AbstractStepper[C],
        schedule: Schedule,
        *,
        health: Health[C],
        recorded: float = 0.0,
    ) -> None:
        self._sink = sink
        self._stepper = stepper
        self._schedule = schedule
        self._points = OutputPoints(schedule.points)
        self._health = health
        self._reports: list[StepReport] = []
        self._saved = recorded  # time of the last checkpoint
        self._stored, self._kept = -np.inf, monotonic()  # wall times of last commit, checkpoint
        self.recorded = recorded
        self.committed = 0.0
        self.crossings: list[dict[str, Any]] = []
        self.spatial_error = 0.0

    def start(self, carry: C) -> None:
        """Record the initial state and commit it."""
        moment = snapshot(self._stepper, carry)
        self._sink.append(trajectory_records(moment, self._points))
        self._sink.append(self._observed(moment))
        self.commit(carry, Status("running", moment.time))

    def step(self, carry: C, report: StepReport, until: float) -> None:
        """Record what became due, up to `until`, in the step that led to `carry`."""
        self._reports.append(report)
        self.spatial_error = float(np.fmax(self.spatial_error, report.spatial_error))
        self._health.note("spatial_error", report.spatial_error, report.time)
        self._health.step(carry)
        self.catch_up(carry, until)
        if monotonic() - self._kept >= MOST_COMMIT_SECONDS:
            self.commit(carry, Status("running", self.recorded))

    def catch_up(self, carry: C, until: float) -> None:
        """Record what is due in the last step and has not been, up to `until`."""
        now = self._stepper.time(carry)
        before, end = self.recorded, min(now, until) if self._stepper.dense else now
        self.recorded = max(before, end)
        schedule = self._schedule
        seen = self._due(schedule.observables_interval, before, end)
        if seen:
            moments = (snapshot(self._stepper, carry, t) for t in seen)
            self._sink.append(together([self._observed(moment) for moment in moments]))
        places = self._due(schedule.positions_every, before, end)
        if places:
            moments = (snapshot(self._stepper, carry, t) for t in places)
            self._sink.append(together([trajectory_records(m, self._points) for m in moments]))
            if monotonic() - self._stored >= LEAST_COMMIT_SECONDS:
                due = is_due(schedule.checkpoint_interval, self._saved, end)
                self.commit(carry if due else None, Status("running", end))

    def _observed(self, moment: Snapshot) -> Records:
        """Return the observables of a moment, with those of the run's health."""
        records = observable_records(moment)
        found = records | self._health.observed(records)
        held = self._sink.names
        return {name: values for name, values in found.items() if name in held}

    def _due(self, interval: float, before: float, end: float) -> list[float]:
        """Return the times to record: the due ones themselves if dense, else the step's end."""
        times = due_times(interval, before, end) if end > before else []
        return times if self._stepper.dense or not times else [end]

    def recall(self, crossings: str, *, until: float) -> None:
        """Take over the crossings that a stopped run had noted up to time `until`."""
        self.crossings = [c for c in json.loads(crossings) if c["time"] <= until * (1.0 + 1e-9)]

    def recall_errors(self, checkpoint: Checkpoint | None) -> None:
        """Take over what a stopped run knew of its own error at its last checkpoint."""
        if checkpoint is not None:
            self.spatial_error = float(checkpoint.meta["spatial_error"])
            self._health.recall(checkpoint.meta.get("health"))

    def note_crossings(self, found: tuple[Crossing, ...], report: StepReport) -> None:
        """Keep which fibers passed through each other in a step, and when."""
        for c in found:
            when = report.time - (1.0 - c.fraction) * report.step_size
            self.crossings.append({"time": when, "fibers": [c.first, c.second]})
        if found:
            self._sink.set_attributes({"crossings": json.dumps(self.crossings)})

    def note_length(self, error: float, report: StepReport) -> None:
        """Keep the relative length error of a fiber at the end of a step, if it is the worst."""
        self._health.note("length_error", error, report.time)

    def judged(self, status: Status, carry: C | None = None) -> Status:
        """Return `status` with whether the run can be trusted so far, `carry` being the last."""
        return self._health.judged(status, self.crossings, carry)

    def commit(self, carry: C | None, status: Status) -> Status:
        """Commit all records, with `carry` as checkpoint unless None.

        The status is stored, and returned, with whether the run can be trusted.
        """
        status = self.judged(status, carry)
        if self._reports:
            self._sink.append(step_records(self._reports))
            self._reports = []
        checkpoint = None
        if carry is not None:
            meta = {
                "step": carry.step,
                "recorded": self.recorded,
                "spatial_error": self.spatial_error,
                "health": self._health.state(),
            }
            checkpoint = Checkpoint(self._stepper.stored(carry), meta)
        self._sink.commit(status.to_dict(), checkpoint)
        self.committed, self._stored = status.time, monotonic()
        if carry is not None:
            self._saved, self._kept = status.time, self._stored
        return status
