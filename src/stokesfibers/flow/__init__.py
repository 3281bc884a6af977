"""Background flows U(x, t): velocity and gradient, one family per file."""

from __future__ import annotations

from stokesfibers.flow.base import AbstractFlow, to_dict
from stokesfibers.flow.extension import Extension, PlanarExtension
from stokesfibers.flow.rotation import Rotation
from stokesfibers.flow.shear import OscillatoryShear, Shear, TimeDependentShear
from stokesfibers.flow.source import SourceFile
from stokesfibers.flow.sum import SumOfFlows
from stokesfibers.flow.uniform import NoFlow, Uniform
from stokesfibers.flow.user import UserFlow, load_user_flow

FLOWS: dict[str, type[AbstractFlow]] = {
    family.kind: family
    for family in (
        Shear,
        OscillatoryShear,
        Extension,
        PlanarExtension,
        Rotation,
        Uniform,
        NoFlow,
    )
}
"""Families built from plain numbers, by the kind a case file names."""

__all__ = [
    "FLOWS",
    "AbstractFlow",
    "Extension",
    "NoFlow",
    "OscillatoryShear",
    "PlanarExtension",
    "Rotation",
    "Shear",
    "SourceFile",
    "SumOfFlows",
    "TimeDependentShear",
    "Uniform",
    "UserFlow",
    "load_user_flow",
    "to_dict",
]
