"""Functions as grids: sampled as finely as linear interpolation needs to meet them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ._core import SceneError

#: Cells along an axis: at first, and at most in one, two and three dimensions.
_FIRST = {1: 64, 2: 32, 3: 16}
_MOST = {1: 65_536, 2: 2048, 3: 256}

#: Mean error of linear interpolation, over the mean density, that is met before refinement ends.
_AIM = 1e-3


def sampled(
    function: Callable[..., Any], corners: tuple[list[float], list[float]], cells: int | None, periodic: bool
) -> tuple[np.ndarray, list[np.ndarray], dict[str, Any]]:
    """Values in the middles of equal cells, the cells' edges, and how far linear interpolation is from the function where it is
    farthest from the samples, at the corners of the cells."""
    low, high = corners
    d = len(low)
    if d not in _MOST:
        raise SceneError(f"density: a function in a box of {d} axes; expected one to three")
    if cells is not None and cells < 2:
        raise SceneError(f"samples: is {cells}; expected at least 2")
    count = cells or _FIRST[d]
    while True:
        edges = [np.linspace(a, b, count + 1) for a, b in zip(low, high)]
        values = _evaluate(function, [0.5 * (e[1:] + e[:-1]) for e in edges])
        mean, largest = _interpolation_error(function, values, edges, periodic)
        if cells is not None or mean <= _AIM or 2 * count > _MOST[d]:
            return values, edges, {"cells": [count] * d, "mean_error": mean, "largest_error": largest}
        count *= 2


def _evaluate(function: Callable[..., Any], axes: list[np.ndarray]) -> np.ndarray:
    """On all points of a grid at once."""
    points = np.meshgrid(*axes, indexing="ij")
    values = np.asarray(function(*points), dtype=float)
    if values.ndim == 0:
        return np.full(points[0].shape, float(values))
    if values.shape != points[0].shape:
        raise SceneError(
            f"density: the function returns an array of shape {values.shape} for points of shape {points[0].shape}; expected the same"
        )
    return values


def _interpolation_error(
    function: Callable[..., Any], values: np.ndarray, edges: list[np.ndarray], periodic: bool
) -> tuple[float, float]:
    """Mean and largest at the corners between cells, over the mean."""
    between = values
    for axis in range(values.ndim):
        if periodic:
            between = 0.5 * (between + np.roll(between, -1, axis))
        else:
            upper = np.take(between, range(1, between.shape[axis]), axis)
            lower = np.take(between, range(between.shape[axis] - 1), axis)
            between = 0.5 * (upper + lower)
    at = [e[1:] if periodic else e[1:-1] for e in edges]
    difference = np.abs(between - _evaluate(function, at))
    scale = float(np.mean(np.abs(values)))
    if not scale > 0.0:
        return 0.0, 0.0
    return float(np.mean(difference)) / scale, float(np.max(difference)) / scale
