"""The experiments of ``reproduce`` as entries: each row that has a range becomes a finding."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from stokesfibers.experiments.base import Experiment, Settings
from stokesfibers.experiments.registry import EXPERIMENTS
from stokesfibers.study.validation.record import Entry, Finding, Group, Tier, of_row

QUICK = ("fig01", "fig05", "fig06", "fig14", "fig17", "fig18", "thresholds", "sedimentation")
"""Experiments whose quick tier is part of the quick suite."""
GROUPED: dict[str, Group] = {"thresholds": "independent", "sedimentation": "exact"}
"""Experiments that are not held against the paper."""
POINTERS = {
    "fig06": "errata: Fig. 6, integral of N1",
    "fig08": "validation: Orders of convergence from N = 50, 100, 200",
    "fig13": "validation: 25 filaments in oscillating shear",
    "stable_dt": "validation: Largest stable step",
    "tolerance": "validation: Error control",
}
"""Where differences that an experiment knows of are explained: a page, and what to look for."""


def _entry(experiment: Experiment) -> Entry:
    name = experiment.name

    def work(settings: Settings) -> Iterator[Finding]:
        folder = settings.folder / "reproduced"
        folder.mkdir(parents=True, exist_ok=True)
        data = experiment.run(replace(settings, folder=folder))
        for row in experiment.check(data):
            if row.verdict != "reported":
                yield of_row(row, POINTERS.get(name) or row.known)

    tier: Tier = "quick" if name in QUICK else "full"
    group = GROUPED.get(name, "published")
    return Entry(name, group, experiment.title, experiment.source, work, tier)


ENTRIES = tuple(_entry(experiment) for experiment in EXPERIMENTS.values())
