"""Background flows given by a user's own functions, in Python or in a file.

Whatever such a function returns is checked, since a wrong shape would broadcast into a silent
error and a NaN would surface only many steps later, far from its cause.
"""

from __future__ import annotations

import sys
import traceback
from collections.abc import Callable
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from types import ModuleType
from typing import Any, ClassVar, cast, final

import numpy as np

from stokesfibers.core import checks
from stokesfibers.core.arrays import Array, Points
from stokesfibers.core.errors import InputError
from stokesfibers.flow.base import AbstractFlow, as_points, qualified_name
from stokesfibers.flow.source import SourceFile, source_file, sources_of

PointFunction = Callable[[Points, float], Any]
"""Maps points (n, 3) and a time to one value per point: (n, 3), or (n, 3, 3) for a gradient."""

# Where `rate_scale` looks, in units of the length scale, and when. Points off the axes and planes
# of symmetry, where fields such as vortices are singular or at rest.
_SAMPLE_POINTS = np.array(
    [[0.31, 0.17, -0.23], [-0.41, 0.29, 0.13], [0.19, -0.37, 0.43], [-0.11, -0.47, -0.07]]
)
_SAMPLE_TIMES = (0.0, 0.21, 0.47, 0.83)


@final
@dataclass(frozen=True)
class UserFlow(AbstractFlow):
    """The flow U = velocity_function(points, t).

    Attributes
    ----------
    velocity_function
        Maps points of shape (n, 3) and a time to velocities of shape (n, 3). It gets a copy.
    gradient_function
        Maps the same to gradients of shape (n, 3, 3), entry [., i, j] being dU_i/dx_j; None takes
        central differences of the velocity.
    name
        What to call the flow in messages.
    length_scale
        Length over which the velocity varies, above zero; sets the step of the differences.
    sources
        Files that define the functions; found when the flow is made, unless given.

    Raises
    ------
    InputError
        From `velocity` and `gradient`: when a function raises, or returns a wrong shape, values
        that are not real numbers, or values that are not finite. The message names the function,
        the time and the first point concerned.
    """

    kind: ClassVar[str] = "python"

    velocity_function: PointFunction
    gradient_function: PointFunction | None = None
    name: str = "user"
    length_scale: float = field(default=1.0, kw_only=True)
    sources: tuple[SourceFile, ...] = field(default=(), kw_only=True, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not callable(self.velocity_function):
            expected = "a function of points (n, 3) and time"
            raise InputError("velocity_function", expected, repr(self.velocity_function))
        if self.gradient_function is not None and not callable(self.gradient_function):
            expected = "a function of points (n, 3) and time, or None"
            raise InputError("gradient_function", expected, repr(self.gradient_function))
        if not isinstance(self.name, str) or not self.name:
            raise InputError("name", "a text that is not empty", repr(self.name))
        scale = checks.positive("length_scale", self.length_scale)
        object.__setattr__(self, "length_scale", scale)
        if not self.sources:
            files = sources_of(self.velocity_function, self.gradient_function)
            object.__setattr__(self, "sources", files)

    def velocity(self, x: Points, t: float) -> Points:
        points = as_points(x)
        return self._velocities(points.reshape(-1, 3), t).reshape(points.shape)

    def gradient(self, x: Points, t: float) -> Array:
        """Return dU_i/dx_j [1/time], shape (..., 3, 3), at `x`, shape (..., 3), and time `t`.

        Without a gradient function: central differences of second order. Their step h balances
        the truncation error h^2/L^2 against the rounding of a velocity that may grow with |x|,
        h = L (eps max(1, |x_j|/L))^(1/3), with L the length scale and eps the float64 precision.
        """
        points = as_points(x)
        flat = points.reshape(-1, 3)
        function = self.gradient_function
        if function is None:
            result = self._differences(flat, t)
        else:
            label = f"gradient function '{qualified_name(function)}' of flow '{self.name}'"
            result = evaluate(function, label, flat, t, entry=(3, 3))
        return result.reshape(*points.shape, 3)

    def rate_scale(self) -> float:
        """Return the largest gradient entry [1/time] found at a few fixed points and times.

        The points lie within the length scale of the origin, the times in [0, 1]. Where the
        function fails there it is left out, since it may be meant for other places; zero is
        returned if all fail.
        """
        found = [0.0]
        for point in _SAMPLE_POINTS * self.length_scale:
            for t in _SAMPLE_TIMES:
                try:
                    with np.errstate(all="ignore"):
                        found.append(float(np.abs(self.gradient(point, t)).max()))
                except InputError:
                    continue
        return max(found)

    def _velocities(self, points: Points, t: float) -> Points:
        function = self.velocity_function
        label = f"velocity function '{qualified_name(function)}' of flow '{self.name}'"
        return evaluate(function, label, points, t, entry=(3,))

    def _differences(self, points: Points, t: float) -> Array:
        length = self.length_scale
        step = length * np.cbrt(np.finfo(np.float64).eps * np.maximum(1.0, np.abs(points) / length))
        shift = step[:, None, :] * np.eye(3)  # (point, direction j, space)
        ahead, behind = points[:, None, :] + shift, points[:, None, :] - shift
        both = self._velocities(np.concatenate([ahead, behind]).reshape(-1, 3), t)
        change = both.reshape(2, -1, 3, 3)
        # What was added differs from the step by rounding; divide by the distance really made.
        distance = np.einsum("njj->nj", ahead - behind)
        by_direction = (change[0] - change[1]) / distance[:, :, None]
        return np.ascontiguousarray(by_direction.swapaxes(-1, -2))


def load_user_flow(
    path: str | PathLike[str],
    velocity: str = "velocity",
    gradient: str = "gradient",
    *,
    length_scale: float = 1.0,
) -> UserFlow:
    """Return the flow whose functions stand in a Python file. This runs the file.

    Parameters
    ----------
    path
        The file. It is read once, and the recorded sha256 is that of the bytes that ran.
    velocity, gradient
        Names of the functions in it, see `UserFlow`. Without the second, differences are taken.
    length_scale
        Length over which the velocity varies, see `UserFlow`.

    Raises
    ------
    InputError
        If the file cannot be read, does not import, or lacks the velocity function.
    """
    module, source = loaded_file(path)
    velocity_function = function_of(module, str(path), velocity)
    if velocity_function is None:
        names = sorted(n for n, v in vars(module).items() if callable(v) and n[0] != "_")
        got = f"a file with {', '.join(names) if names else 'no function'}"
        raise InputError(str(path), f"a function named '{velocity}'", got)
    gradient_function = function_of(module, str(path), gradient)
    return UserFlow(
        velocity_function,
        gradient_function,
        name=Path(path).stem,
        length_scale=length_scale,
        sources=(source,),
    )


def loaded_file(path: str | PathLike[str]) -> tuple[ModuleType, SourceFile]:
    """Run a user's file; return its module and what it was made of.

    Raises
    ------
    InputError
        If the file cannot be read or does not import.
    """
    file = Path(path)
    try:
        content = file.read_bytes()
    except OSError as error:
        got = f"{type(error).__name__}: {error.strerror}"
        raise InputError(str(path), "a Python file that can be read", got) from error
    source = source_file(file, content)
    return _run_file(file, content, f"{file.stem}_{source.sha256[:12]}"), source


def _run_file(file: Path, content: bytes, name: str) -> ModuleType:
    """Run source code as module `name`; compiled here, so that no stale bytecode is picked up."""
    resolved = str(file.resolve())
    module = ModuleType(name)
    module.__file__ = resolved
    # Dataclasses and pickling look a module up by name while the file runs.
    sys.modules[name] = module
    try:
        # Without `dont_inherit` the file would get the __future__ imports of this module.
        exec(compile(content, resolved, "exec", dont_inherit=True), vars(module))
    except (Exception, SystemExit) as error:
        sys.modules.pop(name, None)
        got = f"{type(error).__name__}: {error}{_line_of(error, resolved)}"
        raise InputError(str(file), "a Python file that imports", got) from error
    return module


def _line_of(error: BaseException, filename: str) -> str:
    """Return the line where an error arose; empty for syntax errors, whose text has it."""
    frames = [f for f in traceback.extract_tb(error.__traceback__) if f.filename == filename]
    return f" (line {frames[-1].lineno})" if frames else ""


def function_of(module: ModuleType, where: str, name: str) -> PointFunction | None:
    value = getattr(module, name, None)
    if value is not None and not callable(value):
        raise InputError(where, f"'{name}' to be a function", repr(value))
    return cast("PointFunction | None", value)


def evaluate(
    function: PointFunction, label: str, points: Points, t: float, *, entry: tuple[int, ...]
) -> Array:
    """Return the checked values of `function`, shape (n, *entry), at `points`, shape (n, 3)."""
    where = f"{label} at t = {t:.6g}"
    shape = (len(points), *entry)
    if len(points) == 0:
        return np.zeros(shape)
    try:
        # Copies in and (by astype) out: neither side may change arrays the other still uses.
        values = np.asarray(function(points.copy(), t))
    except Exception as error:
        got = f"{type(error).__name__}: {error}; first point {_shown(points[0])}"
        raise InputError(where, f"an array of shape {shape}", got) from error
    if values.shape != shape:
        got = f"shape {values.shape}; first point {_shown(points[0])}"
        raise InputError(where, f"an array of shape {shape}", got)
    if values.dtype.kind not in "fiu":
        got = f"values of type {values.dtype}; first point {_shown(points[0])}"
        raise InputError(where, "real numbers", got)
    values = values.astype(np.float64, order="C")
    bad = ~np.isfinite(values.reshape(len(points), -1)).all(axis=1)
    if bad.any():
        first = int(np.argmax(bad))
        got = f"{_shown(values[first].ravel())} at point {_shown(points[first])}"
        raise InputError(where, "finite values", f"{got}, the first of {int(bad.sum())}")
    return values


def _shown(values: Array) -> str:
    return f"({', '.join(f'{v:.6g}' for v in values)})"
