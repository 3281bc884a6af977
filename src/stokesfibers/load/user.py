"""A force per length given by a user's own function, in Python or in a file.

The stress of a fiber under a net force is taken about its centre, see `load.gravity`: the load adds
``- int g (x - x_c) ds`` to the integral over the elastic force. Where it exerts a torque on a fiber
this is not symmetric.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import Any, ClassVar, final

import numpy as np

from stokesfibers.core.arrays import Array, Points, Positions
from stokesfibers.core.errors import InputError
from stokesfibers.flow.base import qualified_name
from stokesfibers.flow.source import SourceFile, sources_of
from stokesfibers.flow.user import evaluate, function_of, loaded_file
from stokesfibers.load.base import AbstractLoad, LoadedState

DensityFunction = Callable[[Points, float], Any]
"""Maps points (n, 3) and a time to forces per length (n, 3)."""


@final
@dataclass(frozen=True)
class UserLoad(AbstractLoad):
    """The force per length g = density_function(points, t).

    Attributes
    ----------
    density_function
        Maps points of shape (n, 3), the unwrapped nodes of fiber after fiber, and a time to forces
        per length of shape (n, 3). It gets a copy.
    name
        What to call the load in messages.
    function_name
        Its name in the file that it came from; None for one typed in Python.
    sources
        Files that define the function; found when the load is made, unless given.

    Raises
    ------
    InputError
        From `density` and `stress`: when the function raises, or returns a wrong shape, values that
        are not real numbers, or values that are not finite.
    """

    density_function: DensityFunction
    name: str = "user"
    function_name: str | None = field(default=None, kw_only=True)
    sources: tuple[SourceFile, ...] = field(default=(), kw_only=True, repr=False, compare=False)
    kind: ClassVar[str] = "python"
    citation: ClassVar[str] = "a user's function"
    has_net_force: ClassVar[bool] = True

    def __post_init__(self) -> None:
        if not callable(self.density_function):
            expected = "a function of points (n, 3) and time"
            raise InputError("density_function", expected, repr(self.density_function))
        if not self.sources:
            object.__setattr__(self, "sources", sources_of(self.density_function))

    def density(self, state: LoadedState) -> Positions:
        label = f"density function '{qualified_name(self.density_function)}' of load '{self.name}'"
        points = np.ascontiguousarray(state.positions).reshape(-1, 3)
        found = evaluate(self.density_function, label, points, state.time, entry=(3,))
        return found.reshape(state.positions.shape)

    def stress(self, state: LoadedState) -> Array:
        weights = state.weights[:, :, None]
        centre = (weights * state.positions).sum(axis=1) / weights.sum(axis=1)
        arm = state.positions - centre[:, None]
        return -np.einsum("fn,fni,fnj->ij", state.weights, self.density(state), arm)


def load_user_load(path: str | PathLike[str], density: str = "density") -> UserLoad:
    """Return the load whose function stands in a Python file. This runs the file.

    Parameters
    ----------
    path
        The file. It is read once, and the recorded sha256 is that of the bytes that ran.
    density
        Name of the function in it, see `UserLoad`.

    Raises
    ------
    InputError
        If the file cannot be read, does not import, or lacks the function.
    """
    module, source = loaded_file(path)
    function = function_of(module, str(path), density)
    if function is None:
        raise InputError(str(path), f"a function named '{density}'", "a file without it")
    return UserLoad(function, Path(path).stem, function_name=density, sources=(source,))
