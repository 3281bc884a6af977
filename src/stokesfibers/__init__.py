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
    from stokesfibers.domain import Free, Periodic, Sheared
    from stokesfibers.fiber import curves as shapes
    from stokesfibers.fiber.parameters import Fiber
    from stokesfibers.fiber.suspension import Lattice, Suspension
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
    from stokesfibers.load import Gravity, StericRepulsion, UserLoad
    from stokesfibers.observe.averages import average_of
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
    from stokesfibers.studio.export import export_run
    from stokesfibers.studio.movie import Film, movie
    from stokesfibers.studio.report import report
    from stokesfibers.studio.view import save_view, view_run
    from stokesfibers.studio.view_look import Look
    from stokesfibers.studio.view_slice import VelocitySlice
    from stokesfibers.study.sweep import sweep

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
    "Lattice": "fiber.suspension",
    "Suspension": "fiber.suspension",
    **dict.fromkeys(_FLOWS, "flow"),
    **dict.fromkeys(("Free", "Periodic", "Sheared"), "domain"),
    **dict.fromkeys(("Gravity", "StericRepulsion", "UserLoad"), "load"),
    "average_of": "observe.averages",
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
    "Film": "studio.movie",
    "movie": "studio.movie",
    "report": "studio.report",
    "export_run": "studio.export",
    "Look": "studio.view_look",
    "VelocitySlice": "studio.view_slice",
    **dict.fromkeys(("save_view", "view_run"), "studio.view"),
    "sweep": "study.sweep",
}
_MODULES = ("plot", "shapes")

__all__ = [
    "Case",
    "ConstantRegularization",
    "Extension",
    "Fiber",
    "Film",
    "Free",
    "Gravity",
    "InputError",
    "Lattice",
    "LocalDrag",
    "Look",
    "NoFlow",
    "NoRegularization",
    "NonLocal",
    "OscillatoryShear",
    "PaperEngine",
    "PaperRegularization",
    "Periodic",
    "PlanarExtension",
    "Problem",
    "Result",
    "Rotation",
    "Shear",
    "Sheared",
    "SpectralEngine",
    "SpheroidalRegularization",
    "StericRepulsion",
    "StokesFibersError",
    "StopWhen",
    "StoreError",
    "SumOfFlows",
    "Suspension",
    "TimeDependentShear",
    "Uniform",
    "UserFlow",
    "UserLoad",
    "VelocitySlice",
    "__version__",
    "average_of",
    "every",
    "export_run",
    "fluid_velocity",
    "load_case",
    "movie",
    "open_run",
    "plot",
    "report",
    "resume",
    "save_view",
    "shapes",
    "simulate",
    "sweep",
    "velocity_from_run",
    "view_run",
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
