"""Sums over periodic images, and what happens where fibers come close."""

from __future__ import annotations

from stokesfibers.summation.images import (
    AbstractImageSum,
    EngineImages,
    FastImages,
    ImageSum,
    TruncatedSum,
)
from stokesfibers.summation.periodic_kernel import ExactImages

IMAGE_SUMS: dict[str, type[AbstractImageSum]] = {
    s.kind: s for s in (ImageSum, TruncatedSum, ExactImages, FastImages)
}
"""Image sums by the name a case file gives."""

__all__ = [
    "IMAGE_SUMS",
    "AbstractImageSum",
    "EngineImages",
    "ExactImages",
    "FastImages",
    "ImageSum",
    "TruncatedSum",
]
