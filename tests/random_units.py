"""Random units around a given one, for tests."""

from __future__ import annotations

import numpy as np


def random_units(
    unit: np.ndarray, columns: tuple[str, ...], generator: np.random.Generator, count: int, spread: float = 0.5
) -> np.ndarray:
    """Return units with magnitudes of ± the spread around the unit's and random phases; modification is kept."""
    units = np.repeat(unit, count, axis=0)
    for first, name in enumerate(columns):
        factor = generator.uniform(1 - spread, 1 + spread, count)
        if name.endswith(".x") or ".cos" in name:
            magnitude = np.hypot(units[:, first], units[:, first + 1]) * factor
            phase = generator.uniform(0, 2 * np.pi, count)
            units[:, first], units[:, first + 1] = magnitude * np.cos(phase), magnitude * np.sin(phase)
        elif name in ("pin.diameter", "housing.groove.radius"):
            units[:, first] *= factor
    return units
