"""Where a run without a file keeps its records; the counterpart of the store."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from stokesfibers.io.layout import ArrayLayout
from stokesfibers.run.layout import Records

if TYPE_CHECKING:
    import xarray as xr

_SPACE = ("x", "y", "z")


class MemorySink:
    """Collects records and gives them as the same tree that a store opens to."""

    def __init__(
        self,
        layout: Mapping[str, ArrayLayout],
        attributes: Mapping[str, Any],
        labels: Mapping[str, Sequence[str]],
    ) -> None:
        self._layout = dict(layout)
        self._attributes = dict(attributes)
        self._labels: dict[str, Sequence[str]] = {**dict.fromkeys(("space", "i", "j"), _SPACE)}
        self._labels.update(labels)
        self._parts: dict[str, list[np.ndarray]] = {key: [] for key in layout}
        self._status: dict[str, Any] = {}

    @property
    def names(self) -> frozenset[str]:
        """What can be appended."""
        return frozenset(self._layout)

    @property
    def lengths(self) -> dict[str, int]:
        """Number of records by group."""
        found = {key.split("/")[0]: sum(map(len, parts)) for key, parts in self._parts.items()}
        return {group: n for group, n in found.items() if n}

    def set_attributes(self, attributes: Mapping[str, Any]) -> None:
        """Set attributes of the run."""
        self._attributes.update(attributes)

    def append(self, records: Records) -> None:
        """Add records, each array with a leading growing axis."""
        for key, values in records.items():
            self._parts[key].append(values)

    def commit(self, status: Mapping[str, Any], checkpoint: object = None) -> None:  # noqa: ARG002
        """Keep the status; memory needs no checkpoint."""
        self._status = dict(status)

    def tree(self) -> xr.DataTree:
        """Return everything recorded so far."""
        import xarray as xr  # slow to import, and a run with a store does not need it

        groups: dict[str, dict[str, xr.Variable]] = {}
        for key, array in self._layout.items():
            group, name = key.split("/")
            variable = array.variable
            empty = np.empty((0, *array.shape_tail), dtype=variable.dtype)
            values = array.fixed
            if values is None:
                values = np.concatenate([empty, *self._parts[key]])
            groups.setdefault(group, {})[name] = xr.Variable(
                variable.dims, values, variable.attrs()
            )
        datasets = {}
        for group, variables in groups.items():
            dims = {str(d) for v in variables.values() for d in v.dims}
            labels = {d: list(self._labels[d]) for d in dims & self._labels.keys()}
            datasets[group] = xr.Dataset(variables).assign_coords(labels)  # type: ignore[arg-type]
        tree = xr.DataTree.from_dict(datasets)
        tree.attrs.update(self._attributes, status=self._status)
        return tree
