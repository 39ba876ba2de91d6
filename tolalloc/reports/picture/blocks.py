"""A scene as JSON, its arrays to the last digit: their bytes in base64, read by Python and by a browser alike."""

from __future__ import annotations

from base64 import b64decode, b64encode
from collections.abc import Mapping
from dataclasses import asdict, fields
from typing import Any

import numpy as np
from jaxtyping import Float

from tolalloc.reducers.scene import Scene

VERSION = 1
"""Of the JSON; a picture refuses another one [-]."""
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


def scene_record(scene: Scene, coarse: bool = False) -> dict[str, Any]:
    """Return a scene as JSON knows it; a coarse one is small, 255 steps for all pins or parts."""
    found = {field.name: getattr(scene, field.name) for field in fields(scene)}
    for name in ("forward", "backward"):
        found[name] = {
            key: (coarse_block if coarse and value.ndim > 1 else block)(value)
            if isinstance(value, np.ndarray)
            else value
            for key, value in asdict(found[name]).items()
        }
    found["places"] = [asdict(place) | {"sources": list(place.sources)} for place in scene.places]
    return {"version": VERSION, **found, "carrier_angle": block(scene.carrier_angle)}
