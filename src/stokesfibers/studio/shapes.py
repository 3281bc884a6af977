"""Geometry of whole fibers for viewers: tangents, the colour's quantity, cell edges, tubes."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from stokesfibers.plot.geometry import slanted

Floats = NDArray[np.float64]

_CORNERS = np.array(list(product((0, 1), repeat=3)))
EDGES = np.array(
    [(a, b) for a, b in combinations(range(8), 2) if np.sum(_CORNERS[a] != _CORNERS[b]) == 1]
)
"""Pairs of corners (12, 2) that an edge of the cell joins."""


def tangents(position: Floats, arclength: Floats) -> Floats:
    """Return unit tangents (fiber, node, 3), second order in the spacing of the points.

    Parameters
    ----------
    position : (fiber, node, 3)
        Centrelines.
    arclength : (fiber, node)
        Arclength of the points, growing.
    """
    h = np.diff(arclength, axis=1)[..., None]
    slope = np.diff(position, axis=1) / h
    if slope.shape[1] == 1:
        out = np.repeat(slope, 2, axis=1)
    else:
        back, ahead = h[:, :-1], h[:, 1:]
        bend = (slope[:, 1:] - slope[:, :-1]) / (back + ahead)
        middle = slope[:, :-1] + back * bend
        first = slope[:, :1] - h[:, :1] * bend[:, :1]
        last = slope[:, -1:] + h[:, -1:] * bend[:, -1:]
        out = np.concatenate([first, middle, last], axis=1)
    size = np.linalg.norm(out, axis=-1, keepdims=True)
    return out / np.where(size > 0.0, size, 1.0)


def angle_to_x(tangent: Floats) -> Floats:
    """Return the angle between tangents (..., 3) and the x axis in degrees, 0 to 90."""
    return np.degrees(np.arccos(np.clip(np.abs(tangent[..., 0]), 0.0, 1.0)))


def cell_box(lengths: Floats, points: Floats) -> Floats:
    """Return the limits (3, 2) of the cell; in free directions what the points (..., 3) fill.

    Parameters
    ----------
    lengths : (3,)
        Periods, 0 in free directions.
    """
    flat = points.reshape(-1, 3)
    flat = flat[np.isfinite(flat).all(axis=1)]
    low, high = (flat.min(axis=0), flat.max(axis=0)) if len(flat) else (np.zeros(3), np.zeros(3))
    least = 0.25 * max(float(np.max(lengths)), float(np.max(high - low)))
    centre, half = 0.5 * (low + high), 0.5 * np.maximum(high - low, least)
    limits = np.stack([centre - half, centre + half], axis=1)
    periodic = lengths > 0.0
    limits[periodic, 0], limits[periodic, 1] = 0.0, lengths[periodic]
    return limits


def cell_corners(box: Floats, lengths: Floats, offset: float) -> Floats:
    """Return the corners (8, 3) of the cell, slanted as the images one period up in y are."""
    corners = np.where(_CORNERS == 0, box[:, 0], box[:, 1])
    return slanted(corners, offset / lengths[1] if offset else 0.0)


@dataclass(frozen=True)
class Tubes:
    """Round surfaces about centrelines, as triangles.

    Attributes
    ----------
    vertices : (vertex, 3)
        Rings of points, node after node, fiber after fiber.
    normals : (vertex, 3)
        Outward.
    """

    vertices: Floats
    normals: Floats


def tube_triangles(fibers: int, nodes: int, sides: int) -> NDArray[np.uint32]:
    """Return the triangles (triangle, 3) between the rings of `tubes`, outward by right hand."""
    ring, side = np.meshgrid(np.arange(nodes - 1), np.arange(sides), indexing="ij")
    a, b = ring * sides + side, ring * sides + (side + 1) % sides
    quads = np.stack([a, b, b + sides, a, b + sides, a + sides], axis=-1).reshape(-1, 3)
    starts = np.arange(fibers)[:, None, None] * nodes * sides
    return (quads[None] + starts).reshape(-1, 3).astype(np.uint32)


def tubes(position: Floats, tangent: Floats, radius: Floats, *, sides: int) -> Tubes:
    """Return tubes of `radius` (fiber, node) about centrelines (fiber, node, 3).

    The rings follow the tangent without twisting about it.
    """
    normal = _carried_normals(tangent)
    binormal = np.cross(tangent, normal)
    # from the normal by way of the binormal is counterclockwise about the tangent
    angle = 2.0 * np.pi * np.arange(sides) / sides
    out = (
        np.cos(angle)[:, None] * normal[:, :, None, :]
        + np.sin(angle)[:, None] * binormal[:, :, None, :]
    )
    vertices = position[:, :, None, :] + radius[:, :, None, None] * out
    return Tubes(vertices.reshape(-1, 3), out.reshape(-1, 3))


def _carried_normals(tangent: Floats) -> Floats:
    """Return unit normals (fiber, node, 3), each the one before it made normal again."""
    normals = np.empty_like(tangent)
    fibers = np.arange(len(tangent))
    seed = np.zeros_like(tangent[:, 0])
    seed[fibers, np.argmin(np.abs(tangent[:, 0]), axis=1)] = 1.0
    for node in range(tangent.shape[1]):
        t = tangent[:, node]
        seed = seed - np.einsum("fi,fi->f", seed, t)[:, None] * t
        size = np.linalg.norm(seed, axis=-1, keepdims=True)
        seed = seed / np.where(size > 0.0, size, 1.0)
        normals[:, node] = seed
    return normals
