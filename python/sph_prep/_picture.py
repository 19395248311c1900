"""A picture of particles as SVG, for notebooks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ._particles import Particles

#: Edge in pixels, and particles that are drawn at most.
_SIZE = 360
_MOST = 4000

#: From low to high density, of even steps in lightness and told apart by the color-blind (after viridis, five of its colors).
_COLORS = np.array([[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]], dtype=float)


def picture(particles: Particles) -> str:
    """Particles of a slab through the middle, or all in fewer dimensions, colored by the logarithm of their density."""
    if len(particles) == 0 or "Coordinates" not in particles:
        return ""
    places = particles.positions.reshape(len(particles), -1).astype(float)
    value = particles.density.astype(float) if "Density" in particles else np.ones(len(places))
    shown = np.arange(len(places))
    if places.shape[1] == 3:
        depth = np.abs(places[:, 2] - np.median(places[:, 2]))
        shown = np.sort(np.argsort(depth, kind="stable")[: min(_MOST, max(1, round(1.5 * len(places) ** (2 / 3))))])
    shown = shown[:: max(1, len(shown) // _MOST)]
    x = places[shown, 0]
    y = places[shown, 1] if places.shape[1] > 1 else np.log10(np.maximum(value[shown], np.finfo(float).tiny))
    low, extent = np.array([x.min(), y.min()]), max(np.ptp(x), np.ptp(y) if places.shape[1] > 1 else 0.0) or 1.0
    stretch = extent if places.shape[1] > 1 else (np.ptp(y) or 1.0)
    column, row = (x - low[0]) / extent * (_SIZE - 8) + 4, _SIZE - 4 - (y - low[1]) / stretch * (_SIZE - 8)
    shade = np.log(np.maximum(value[shown], np.finfo(float).tiny))
    shade = (shade - shade.min()) / (np.ptp(shade) or 1.0) * (len(_COLORS) - 1)
    lower = np.minimum(shade.astype(int), len(_COLORS) - 2)
    part = (shade - lower)[:, None]
    colors = np.rint((1 - part) * _COLORS[lower] + part * _COLORS[lower + 1]).astype(int)
    radius = max(0.8, min(4.0, 0.35 * _SIZE / len(shown) ** 0.5))
    dots = "".join(
        f'<circle cx="{a:.1f}" cy="{b:.1f}" r="{radius:.1f}" fill="rgb({r},{g},{c})"/>'
        for a, b, (r, g, c) in zip(column, row, colors)
    )
    words = f"{len(shown)} of {len(places)} particles, colored by density from {value.min():.3g} to {value.max():.3g}"
    drawn = f'<svg width="{_SIZE}" height="{_SIZE}" role="img" aria-label="{words}"><title>{words}</title>{dots}</svg>'
    caption = f"{words}{_units(particles)}; {_extent(particles, x, y)}"
    return f"<figure style='margin:0'>{drawn}<figcaption>{caption}</figcaption></figure>"


def _units(particles: Particles) -> str:
    """Of the density, where the particles know it."""
    unit = particles.to_cgs("Density") if "Density" in particles else 1.0
    return "" if unit == 1.0 else f" [{unit:.4g} g/cm^{particles.dimension}]"


def _extent(particles: Particles, x: np.ndarray, y: np.ndarray) -> str:
    """What the edges of the picture are."""
    unit = particles.to_cgs("Coordinates")
    words = "" if unit == 1.0 else f" [{unit:.4g} cm]"
    across = f"x from {x.min():.3g} to {x.max():.3g}"
    if particles.dimension == 1:
        return f"{across}{words}, upwards the logarithm of the density"
    return f"{across}, y from {y.min():.3g} to {y.max():.3g}{words}"
