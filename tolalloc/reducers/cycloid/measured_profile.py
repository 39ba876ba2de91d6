"""A disc's profile as a measuring machine gives it: points from the disc's datum, or deviations along the normal."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import pi
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Complex, Float

from tolalloc.drawings.heads import split_header
from tolalloc.drawings.table_file import read_text_table
from tolalloc.exceptions import InputError
from tolalloc.reading.units import ARCSECOND, DEGREE, MICROMETRE, MILLIMETRE
from tolalloc.reducers.cycloid.clearance import removed
from tolalloc.reducers.cycloid.tooth_profile import ToothProfile, nearest_angles, normals, path_of
from tolalloc.reducers.reducer.design import CycloidStage
from tolalloc.reducers.reducer.form import FlankForm, Points, flank_form, read_profile

Places = Complex[np.ndarray, " point"]
"""Points of a plane, x + iy [m]."""
_DENSE = 256  # places of a tooth among which the one nearest to a point is looked for first
_MOVES = 30  # rigid movements until they no longer change
_STILL = 1e-13  # movement that changes nothing any more [m]
_FURTHEST = 2 * MILLIMETRE  # from the theoretical profile that a datum may put a point [m]
_KINDS = (("direction", "radius"), ("x", "y"), ("space", "phi", "deviation"))


@dataclass(frozen=True, kw_only=True)
class Movement:
    """Rigid movement that was taken out of measured points."""

    place: complex  # Where the middle of the teeth lay from the datum, x + iy [m]
    turn: float  # By what the teeth were turned, counter-clockwise positive [rad]

    @property
    def sentence(self) -> str:
        """What was taken out, to be put behind the name of the file."""
        place, angle = abs(self.place) / MICROMETRE, float(np.angle(self.place)) / DEGREE
        return (
            f", after {place:.3g} µm towards {angle:.0f}° and {self.turn / ARCSECOND:.3g}″ of turn were taken out of "
            "its datum by least squares"
        )


@dataclass(frozen=True, kw_only=True)
class MeasuredProfile:
    """The profile of one disc, whole, as a file states it.

    Parameters
    ----------
    path
        The file, whose columns say what it states: ``direction [deg], radius [mm]`` or ``x [mm], y [mm]`` of points
        from the datum; or ``space, phi [deg], deviation [µm]``, along the normal and outward positive, φ from −180 to
        180 about the middle of a tooth space, spaces counted counter-clockwise from 1 at the disc's zero direction.
    datum
        Angle of the machine's zero direction from the disc's, counter-clockwise positive [rad].
    aligned
        Whether the rigid movement of least squares is taken out; points are taken as they are otherwise.
    from_drawing
        Whether deviations are from the profile of the drawing and not from the theoretical one.
    spans
        Spans of a smoothing spline in each space, as `flank_form` chooses unless given; 0 goes through all points [-].
    across
        What a plane model takes of sections along the width, a column ``z [mm]`` of their heights: their ``mean``,
        which is right where the whole width carries, or the ``highest`` of them at every φ, which carries first.
    """

    path: Path
    datum: float = 0.0
    aligned: bool = False
    from_drawing: bool = False
    spans: int | None = None
    across: Literal["mean", "highest"] = "mean"

    @cached_property
    def columns(self) -> tuple[str, ...]:
        """Columns of the file."""
        names = {split_header(header)[0] for header in read_text_table(self.path).headers}
        kind = next((kind for kind in _KINDS if names & set(kind)), _KINDS[0])
        along = kind == _KINDS[-1]
        for field, stated, wrong in (
            ("datum_deg", self.datum / DEGREE, along and self.datum != 0.0),
            ("aligned", "true", along and self.aligned),
            ("from_drawing", "true", not along and self.from_drawing),
        ):
            if wrong:
                kinds = "points, columns direction and radius or x and y" if along else "deviations along the normal"
                raise InputError.at(self.path, field, stated, f"it with {kinds} only")
        return kind

    def form(self, drawn: ToothProfile, number: int) -> tuple[FlankForm, Movement | None]:
        """Return what the disc has beyond its drawing, and the movement that was taken out."""
        stage, moved = drawn.stage, None
        found = read_profile(self.path, self.columns, ("z",))
        if "space" in found:
            angle, deviation = _around(stage, self.path, found["space"], found["phi"]), found["deviation"]
        else:
            radial = "radius" in found
            place = found["radius"] * np.exp(1j * found["direction"]) if radial else found["x"] + 1j * found["y"]
            place = place * np.exp(1j * self.datum)
            if self.aligned:
                place, moved = aligned(stage, place, str(self.path))
            angle, deviation = normal_deviations(stage, place, str(self.path))
        height, section = np.unique(found.get("z", np.zeros_like(angle)), return_inverse=True)
        place_of = f"{self.path}, profile of disc {number}"
        form = self._plane(
            height,
            [
                flank_form(angle[own], deviation[own], stage.disc_teeth, self.spans, place_of)
                for own in (section == at for at in range(height.size))
            ],
        )
        if self.from_drawing:
            return form, moved
        # On the flank of negative φ the drawing's profile is the mirror image.
        folded = np.abs(np.remainder(np.array(form.angle) + pi, 2 * pi) - pi)
        beyond = np.array(form.deviation) + removed(drawn, folded)
        return replace(form, deviation=tuple(beyond.tolist())), moved

    def _plane(self, height: Float[np.ndarray, " section"], sections: list[FlankForm]) -> FlankForm:
        """Return the one form that a plane model takes of sections at heights [m]."""
        if len(sections) == 1:
            return sections[0]
        base = max(sections, key=lambda section: len(section.angle))
        own = np.stack([section.at(np.array(base.angle)) for section in sections])
        if self.across == "highest":
            found = own.max(axis=0)
        else:
            found = np.trapezoid(own, height, axis=0) / (height[-1] - height[0])
        return replace(base, deviation=tuple(found.tolist()))


def _around(stage: CycloidStage, path: Path, space: Points, angle: Points) -> Points:
    """Return φ that goes on clockwise around the disc [rad]."""
    for name, values, wrong, allowed in (
        ("space", space, (space != np.rint(space)) | (space < 1) | (space > stage.disc_teeth), stage.disc_teeth),
        ("phi", angle / DEGREE, np.abs(angle) > pi + 1e-9, 180),
    ):
        if wrong.any():
            low = "a whole number from 1" if name == "space" else "-180°"
            raise InputError.at(path, name, float(values[wrong][0]), f"{low} to {allowed}")
    return np.asarray(angle - 2 * pi * (space - 1))


def normal_deviations(stage: CycloidStage, place: Places, name: str) -> tuple[Points, Points]:
    """Return φ around the disc and the exact distance from the theoretical profile of points, outward positive.

    Points x + iy from the disc's centre, its zero direction along x [m]. With P on the normal n of the path w of the
    grinding pin's centre, (P − w)·w′ = 0, the point stands out by r_rp − (P − w)·n, u(φ) of theory page equation (83)
    [rad, m]: own derivation, exact to rounding.

    Examples
    --------
    A profile ground with a pin that is 2 µm too large is 2 µm too small everywhere.

    >>> from tolalloc.reducers.reducer.design import Modification
    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> stage = load_reducer("rv20e").cycloid_stage
    >>> ground = ToothProfile(stage=stage, modification=Modification(equidistant=2e-6, shift=0.0))
    >>> x, y = ground.points(np.array([0.3, 2.0])).T
    >>> angle, deviation = normal_deviations(stage, x + 1j * y, "disc")
    >>> angle.round(9).tolist(), (1e6 * deviation).round(9).tolist()
    ([0.3, 2.0], [-2.0, -2.0])
    """
    from scipy.spatial import KDTree

    teeth, none = stage.disc_teeth, np.zeros((1, 2))
    dense = 2 * pi * np.arange(_DENSE * teeth) / _DENSE
    path, slope, _ = path_of(stage, none, dense[np.newaxis])
    surface = (path - 1j * slope / np.abs(slope) * stage.pin_radius)[0]
    far, nearest = KDTree(np.stack([surface.real, surface.imag], axis=1)).query(
        np.stack([place.real, place.imag], axis=1)
    )
    if far.max() > _FURTHEST:
        at, allowed = int(far.argmax()), f"up to {_FURTHEST / MILLIMETRE:g}, in mm and from the middle of the disc"
        beyond = float(f"{far[at] / MILLIMETRE:.3g}")
        raise InputError.at(name, f"distance of point {at + 1} from the theoretical profile [mm]", beyond, allowed)
    angle = nearest_angles(stage, place, dense[nearest], none)
    path, slope, _ = path_of(stage, none, angle)
    normal = -1j * slope / np.abs(slope)
    deviation = stage.pin_radius - ((place - path) * normal.conj()).real
    return np.remainder(angle[0], 2 * pi * teeth), np.asarray(deviation[0])


def aligned(stage: CycloidStage, place: Places, name: str) -> tuple[Places, Movement]:
    """Return points moved rigidly so that their squared normal deviations are least, and what was taken out.

    Gauss–Newton steps: a movement by (x, y) and a turn by ψ about the disc's centre let a point stand out by
    −n·(x, y) − ψ·r_d·S less [m]. What is taken out is no error of the disc any more.

    Own derivation, least squares; levers r_d·S, S = −sin a of theory page equation (13).
    """
    start, scale = place, stage.disc_pitch_radius
    shift, turn = 0j, 0.0
    for _ in range(_MOVES):
        angle, deviation = normal_deviations(stage, place, name)
        into = normals(stage.shortening, angle)
        # Direction of the crank on the disc turns by −zp/zc of φ.
        normal = (into.towards_crank + 1j * into.towards_tangent) * np.exp(
            -1j * angle * (stage.pin_count / stage.disc_teeth)
        )
        by = np.stack([-normal.real, -normal.imag, into.lever], axis=1)
        step = np.linalg.lstsq(by, deviation, rcond=None)[0]
        shift, turn = shift + complex(step[0], step[1]) * np.exp(1j * turn), turn + step[2] / scale
        place = (start - shift) * np.exp(-1j * turn)
        if np.abs(step).max() < _STILL:
            break
    return place, Movement(place=shift, turn=turn)
