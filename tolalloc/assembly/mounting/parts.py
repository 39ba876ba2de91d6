"""Measured parts: their errors in their own frames, wherever they may be mounted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class MeasuredPart:
    """One part and its errors; an error that is not named is 0.

    Parameters
    ----------
    name
        What is written on the part.
    kind
        Kind of place that it fits, `tolalloc.assembly.mounting.places.Place.kind`.
    errors
        Error in the part's own name, such as ``runout.cos1`` of a disc → deviation in its own frame [m, angles rad].

    Notes
    -----
    A part's own frame is the one in which the model counts its errors when it stands unturned at the first place of its
    kind. A housing comes with its pins and with what stands fixed in it: ``carrier.assembly``, ``carrier.tilt`` and
    ``sun.assembly``; a crank with its planet, ``planet.eccentricity``, and that planet's share of the mesh,
    ``mesh.deviation``.
    """

    name: str
    kind: str
    errors: Mapping[str, float]
