"""Arrays of numbers inside JSON, to the last digit: their bytes in base64, read by Python and by a browser alike."""

from __future__ import annotations

from base64 import b64decode, b64encode
from collections.abc import Mapping
from typing import Any

import numpy as np
from jaxtyping import Float

LEVELS = 255
"""Steps between the smallest and the largest number of a coarse block [-]."""


def block(values: Float[np.ndarray, "..."]) -> dict[str, Any]:
    """Return an array as an entry of JSON that loses nothing: little-endian doubles.

    Examples
    --------
    >>> block(np.array([1.0]))
    {'type': 'f8', 'shape': [1], 'data': 'AAAAAAAA8D8='}
    """
    content = np.ascontiguousarray(values, "<f8").tobytes()
    return {"type": "f8", "shape": list(values.shape), "data": b64encode(content).decode()}


def coarse_block(values: Float[np.ndarray, "..."]) -> dict[str, Any]:
    """Return an array in 255 equal steps from its smallest to its largest number: exact enough for the eye.

    A number that is not finite becomes 0; one above the smallest stays above it, so that what carries goes on carrying.
    """
    finite = np.nan_to_num(values, nan=0.0, posinf=0.0, neginf=0.0)
    low, high = (float(edge(finite)) if finite.size else 0.0 for edge in (np.min, np.max))
    step = (high - low) / LEVELS
    steps = np.maximum(np.rint((finite - low) / step), finite > low) if step else np.zeros(finite.shape)
    content = b64encode(steps.astype(np.uint8).tobytes()).decode()
    return {"type": "u1", "shape": list(values.shape), "low": low, "step": step, "data": content}


def values_of(entry: Mapping[str, Any]) -> Float[np.ndarray, "..."]:
    """Return the array of an entry.

    Examples
    --------
    >>> values_of(block(np.array([0.1, 2.0])))
    array([0.1, 2. ])
    """
    content, shape = b64decode(entry["data"]), tuple(entry["shape"])
    if entry["type"] == "u1":
        steps = np.frombuffer(content, np.uint8).reshape(shape)
        return np.asarray(entry["low"] + entry["step"] * steps)
    return np.asarray(np.frombuffer(content, "<f8").reshape(shape), float)
