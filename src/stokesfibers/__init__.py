"""Flexible fibers in Stokes flow: non-local slender body theory, from one TOML file.

The names below are loaded when first used, so that the command line starts at once.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from stokesfibers.core.version import __version__

if TYPE_CHECKING:
    from stokesfibers import plot
    from stokesfibers.config.case import Case, load_case
    from stokesfibers.core.errors import InputError, StokesFibersError, StoreError
    from stokesfibers.fiber import curves as shapes
    from stokesfibers.fiber.parameters import Fiber
    from stokesfibers.flow import (
        Extension,
        NoFlow,
        OscillatoryShear,
        PlanarExtension,
        Rotation,
        Shear,
        SumOfFlows,
        TimeDependentShear,
        Uniform,
        UserFlow,
    )
    from stokesfibers.io.reader import open_run
    from stokesfibers.observe.velocity import fluid_velocity
    from stokesfibers.problem.engine import PaperEngine, SpectralEngine
    from stokesfibers.problem.problem import Problem
    from stokesfibers.run.events import StopWhen
    from stokesfibers.run.schedule import every
    from stokesfibers.run.simulate import Result, resume, simulate
    from stokesfibers.run.velocity import velocity_from_run
    from stokesfibers.slender.mobility import LocalDrag, NonLocal
    from stokesfibers.slender.regularization import (
        ConstantRegularization,
        NoRegularization,
        PaperRegularization,
        SpheroidalRegularization,
    )

_FLOWS = (
    "Extension",
    "NoFlow",
    "OscillatoryShear",
    "PlanarExtension",
    "Rotation",
    "Shear",
    "SumOfFlows",
    "TimeDependentShear",
    "Uniform",
    "UserFlow",
)
_REGULARIZATIONS = (
    "ConstantRegularization",
    "NoRegularization",
    "PaperRegularization",
    "SpheroidalRegularization",
)
_HOMES: dict[str, str] = {
    "plot": "plot",
    "shapes": "fiber.curves",
    "Case": "config.case",
    "load_case": "config.case",
    "InputError": "core.errors",
    "StokesFibersError": "core.errors",
    "StoreError": "core.errors",
    "Fiber": "fiber.parameters",
    **dict.fromkeys(_FLOWS, "flow"),
    "open_run": "io.reader",
    "PaperEngine": "problem.engine",
    "SpectralEngine": "problem.engine",
    "Problem": "problem.problem",
    "every": "run.schedule",
    "StopWhen": "run.events",
    "Result": "run.simulate",
    "resume": "run.simulate",
    "simulate": "run.simulate",
    "fluid_velocity": "observe.velocity",
    "velocity_from_run": "run.velocity",
    "LocalDrag": "slender.mobility",
    "NonLocal": "slender.mobility",
    **dict.fromkeys(_REGULARIZATIONS, "slender.regularization"),
}
_MODULES = ("plot", "shapes")

__all__ = [
    "Case",
    "ConstantRegularization",
    "Extension",
    "Fiber",
    "InputError",
    "LocalDrag",
    "NoFlow",
    "NoRegularization",
    "NonLocal",
    "OscillatoryShear",
    "PaperEngine",
    "PaperRegularization",
    "PlanarExtension",
    "Problem",
    "Result",
    "Rotation",
    "Shear",
    "SpectralEngine",
    "SpheroidalRegularization",
    "StokesFibersError",
    "StopWhen",
    "StoreError",
    "SumOfFlows",
    "TimeDependentShear",
    "Uniform",
    "UserFlow",
    "__version__",
    "every",
    "fluid_velocity",
    "load_case",
    "open_run",
    "plot",
    "resume",
    "shapes",
    "simulate",
    "velocity_from_run",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    module = import_module(f"{__name__}.{_HOMES[name]}")
    value = module if name in _MODULES else getattr(module, name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
