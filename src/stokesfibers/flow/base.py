"""What every background flow offers, and its form as plain values for the output file.

The background flow U(x, t) is the undisturbed velocity in the equations of motion,
8 pi mu (x_t - U) = -Lambda f - K f (paper, Eq. (2), there called U_0).
"""

from __future__ import annotations

import abc
import functools
from collections.abc import Callable
from dataclasses import asdict, fields, is_dataclass
from typing import Any, ClassVar

from stokesfibers.core.arrays import Array, Points, as_float
from stokesfibers.core.errors import InputError


class AbstractFlow(abc.ABC):
    """A background flow U(x, t). It holds no state: equal arguments give equal results.

    Attributes
    ----------
    kind
        Name of the family as a case file says it.
    """

    kind: ClassVar[str]

    @abc.abstractmethod
    def velocity(self, x: Points, t: float) -> Points:
        """Return U [length/time], shape (..., 3), at points `x`, shape (..., 3), and time `t`."""

    @abc.abstractmethod
    def gradient(self, x: Points, t: float) -> Array:
        """Return the velocity gradient [1/time], shape (..., 3, 3), at `x`, (..., 3), and `t`.

        Sign and order: ``gradient[..., i, j]`` is dU_i/dx_j.
        """

    @abc.abstractmethod
    def rate_scale(self) -> float:
        """Return a rate [1/time] typical of the flow: the size of its largest gradient entry.

        Zero where nothing is sheared (no flow, uniform flow). It serves defaults, advice and the
        control of steps; the equations of motion do not hold it.
        """

    def strain(self, t: float) -> float:  # noqa: ARG002
        """Return the strain from time 0 to `t` of a flow U = (rate(t) y, 0, 0): a sheared cell's.

        Raises
        ------
        InputError
            If the flow is no such shear.
        """
        raise InputError(
            "flow", "shear or oscillatory_shear, which a sheared cell can follow", repr(self.kind)
        )


def as_points(x: object) -> Points:
    """Return `x` as float64 points of shape (..., 3); InputError for any other last axis."""
    points = as_float(x)
    if points.shape[-1] != 3:
        raise InputError("x", "points of shape (..., 3)", f"shape {points.shape}")
    return points


def qualified_name(function: Callable[..., Any]) -> str:
    """Return ``module.name`` of a function; of the type, if the callable has no name."""
    if isinstance(function, functools.partial):
        return f"partial of {qualified_name(function.func)}"
    named = function if hasattr(function, "__qualname__") else type(function)
    return f"{named.__module__}.{named.__qualname__}"


def to_dict(flow: AbstractFlow) -> dict[str, Any]:
    """Return a flow as JSON-ready values: its kind and its fields, nested for sums.

    Functions are given by their qualified name; the fields ``sources`` of flows that hold
    functions add path and sha256 of the files they come from. For the families in
    `stokesfibers.flow.FLOWS` the entries beside ``kind`` are the arguments that rebuild the flow.
    """
    if not is_dataclass(flow):
        raise TypeError(f"{type(flow).__qualname__} must be a dataclass to be recorded")
    return {"kind": flow.kind} | {f.name: _plain(getattr(flow, f.name)) for f in fields(flow)}


def _plain(value: Any) -> Any:
    if isinstance(value, AbstractFlow):
        return to_dict(value)
    if isinstance(value, tuple):
        return [_plain(entry) for entry in value]
    if is_dataclass(value) and not isinstance(value, type):
        return asdict(value)
    return qualified_name(value) if callable(value) else value
