"""Files for a drawing: DXF in millimetres, whose library enters here, and the tooth profile of a disc."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tolalloc.exceptions import InputError
from tolalloc.reading.files import require_new
from tolalloc.reading.units import DEGREE, MICROMETRE, MILLIMETRE
from tolalloc.reducers.cycloid.clearance import removed
from tolalloc.reducers.cycloid.tooth_profile import ProfilePoints, ToothProfile, profile_points, require_points

if TYPE_CHECKING:
    from ezdxf.document import Drawing


def new_drawing() -> Drawing:
    """Return an empty DXF drawing in millimetres."""
    from ezdxf import units
    from ezdxf.filemanagement import new

    return new("R2010", units=units.MM)


def centre(text: Any, place: tuple[float, float]) -> None:
    """Put the middle of a text of a drawing at a place [mm]."""
    from ezdxf.enums import TextEntityAlignment

    text.set_placement(place, align=TextEntityAlignment.MIDDLE_CENTER)


def _write_csv(profile: ToothProfile, points: ProfilePoints, path: Path) -> None:
    """Write the points with angle, curvature and material removed."""
    import pandas as pd

    angle = points.angle
    frame = pd.DataFrame(
        {
            "x [mm]": points.place[:, 0] / MILLIMETRE,
            "y [mm]": points.place[:, 1] / MILLIMETRE,
            "angle [deg]": angle / DEGREE,
            "curvature, convex positive [1/mm]": profile.curvature(np.abs(angle)) * MILLIMETRE,
            "removed along the normal [µm]": removed(profile, angle) / MICROMETRE,
        }
    )
    frame.to_csv(path, index=False, float_format="%.9g")


def _write_dxf(profile: ToothProfile, points: ProfilePoints, path: Path) -> None:
    drawing = new_drawing()
    space = drawing.modelspace()
    for name, colour in (("TOOTH_PROFILE", 7), ("TIP_AND_ROOT", 8)):
        drawing.layers.add(name, color=colour)
    space.add_lwpolyline(points.place / MILLIMETRE, close=True, dxfattribs={"layer": "TOOTH_PROFILE"})
    for radius in (profile.tip_radius, profile.root_radius):
        space.add_circle((0.0, 0.0), radius / MILLIMETRE, dxfattribs={"layer": "TIP_AND_ROOT"})
    drawing.saveas(path)


WRITERS = {".csv": _write_csv, ".dxf": _write_dxf}
"""Ending of a profile's file → what writes it: CSV for a measuring machine, DXF for a drawing."""


def require_profile_file(path: Path, per_tooth: int) -> None:
    """Raise unless a profile of so many points per tooth can be written to a new ``.csv`` or ``.dxf`` file."""
    require_points(per_tooth)
    if path.suffix.lower() not in WRITERS:
        raise InputError.at("profile file", "ending", path.name, " or ".join(WRITERS))
    require_new(path)


def write_profile(profile: ToothProfile, per_tooth: int, path: Path) -> ProfilePoints:
    """Write the sound profile of a whole disc in millimetres and return its points."""
    require_profile_file(path, per_tooth)
    points = profile_points(profile, per_tooth)
    try:
        WRITERS[path.suffix.lower()](profile, points, path)
    except OSError as error:
        raise InputError(f"{path}: the profile cannot be written ({error.strerror}); name another file.") from None
    return points
