"""Form of flanks and pins, as designed freely or as measured: how far they stand out of cycloid and circle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import pi
from pathlib import Path
from sys import float_info
from typing import Any

import numpy as np
from jaxtyping import Float

from tolalloc.drawings.heads import split_header
from tolalloc.drawings.table_file import believed_number, read_text_table
from tolalloc.exceptions import InputError
from tolalloc.reading.units import DEGREE, MICROMETRE, MILLIMETRE

Points = Float[np.ndarray, " point"]
LARGEST_DEVIATION = 200 * MICROMETRE
"""Largest deviation of a flank that is believed, as that of an amount of the modification [m]."""

LARGEST_FREE = 50 * MICROMETRE
"""Largest free form of a drawing, up to which first order holds as it does for the amounts [m]."""

WIDEST_GAP = pi / 4
"""Largest distance in φ of neighbouring points, eight to a tooth, across which a profile is taken for known [rad]."""

SMOOTHED = 40
"""Spans of the spline of measured points in a tooth space unless stated: 9° of φ, as fine as extremes are found [-]."""

_CLOSE = 1e-9  # points of the two flanks that are nearer in φ are one [rad]
_ANGLE: Mapping[str, float] = {"deg": DEGREE, "°": DEGREE}
_LENGTH: Mapping[str, float] = {"mm": MILLIMETRE}
_UNITS: Mapping[str, Mapping[str, float]] = {
    "space": {"": 1.0},
    "phi": _ANGLE,
    "deviation": {"µm": MICROMETRE, "um": MICROMETRE, "mm": MILLIMETRE},
    "direction": _ANGLE,
    "radius": _LENGTH,
    "x": _LENGTH,
    "y": _LENGTH,
    "z": _LENGTH,
}
"""Column of a profile file → its units and their factors to SI."""


@dataclass(frozen=True, kw_only=True)
class FlankForm:
    """Deviation of a disc's flanks from the theoretical profile along its normal, outward positive, over φ.

    φ is the angle of the pin that grinds the point, 0 in the middle of a tooth space and ±π at the tips beside it. It
    goes on clockwise from space to space, so a whole disc is one function of a period of 2π times its spaces: u of
    theory page equation (83), first order, as a pin feels it where it touches the perfect disc.
    """

    spaces: int  # Tooth spaces after which the form repeats: 1 if all are alike, else the teeth of the disc [-]
    angle: tuple[float, ...]  # φ of the points, rising from 0 to below 2π times the spaces [rad]
    deviation: tuple[float, ...]  # There, outward positive [m]
    spans: int = 0  # Spans of a smoothing spline in each space; 0 for the spline through all points [-]

    @property
    def period(self) -> float:
        """Length in φ after which the form repeats [rad]."""
        return 2 * pi * self.spaces

    def at(self, angle: Float[np.ndarray, "*angles"]) -> Float[np.ndarray, "*angles"]:
        """Return the deviation at angles φ, outward positive [m].

        Between the points it is a periodic cubic spline, own choice: the form has a continuous curvature.
        """
        inside = np.remainder(angle, self.period)
        start = 0.0 if self.spans else self.angle[0]
        return np.asarray(_spline(self)(np.where(inside < start, inside + self.period, inside)))


@lru_cache(maxsize=16)
def _spline(form: FlankForm) -> Any:
    """Return a periodic cubic spline: through every point, or the least squares of equally long spans."""
    from scipy.interpolate import BSpline, CubicSpline
    from scipy.sparse import csr_array
    from scipy.sparse.linalg import spsolve

    angle, deviation = np.array(form.angle), np.array(form.deviation)
    if not form.spans:
        closed = np.append(angle, angle[0] + form.period), np.append(deviation, deviation[0])
        return CubicSpline(*closed, bc_type="periodic")
    count = form.spans * form.spaces
    knots = form.period / count * np.arange(-3, count + 4)
    own = BSpline.design_matrix(angle, knots, 3).tocoo()
    basis = csr_array((own.data, (own.row, own.col % count)), shape=(angle.size, count))
    weight = spsolve((basis.T @ basis).tocsc(), basis.T @ deviation)
    return BSpline(knots, weight[np.arange(count + 3) % count], 3)


def flank_form(angle: Points, deviation: Points, spaces: int, spans: int | None, place: str) -> FlankForm:
    """Return the form through points in any order.

    Points of one φ are taken as their mean, own derivation. Angles φ [rad], deviations outward positive [m]; the place
    is who asks, for messages. Unless spans are stated there are `SMOOTHED` of them where the points are dense enough.
    """
    period = 2 * pi * spaces
    if (most := float(np.abs(deviation).max()) / MICROMETRE) > LARGEST_DEVIATION / MICROMETRE:
        raise InputError.at(place, "largest deviation [µm]", float(f"{most:.4g}"), f"up to {LARGEST_DEVIATION * 1e6:g}")
    inside = np.remainder(angle, period)
    order = np.argsort(inside, kind="stable")
    inside, deviation = inside[order], deviation[order]
    first = np.flatnonzero(np.diff(inside, prepend=-1.0) > _CLOSE)
    members = np.diff(np.append(first, inside.size))
    inside, deviation = inside[first], np.add.reduceat(deviation, first) / members
    gap = float(np.diff(np.append(inside, inside[0] + period)).max())
    apart = float(f"{gap / DEGREE:.3g}")
    if gap > WIDEST_GAP:
        allowed = f"up to {WIDEST_GAP / DEGREE:g} all around"
        raise InputError.at(place, "largest distance in φ of neighbouring points [deg]", apart, allowed)
    if spans is None:
        spans = SMOOTHED if gap <= 2 * pi / SMOOTHED else 0
    if spans and 2 * pi / spans < gap:
        allowed = f"0, or 1 to {int(2 * pi / gap)} where neighbouring points are up to {apart}° of φ apart"
        raise InputError.at(place, "spans", spans, allowed)
    return FlankForm(spaces=spaces, angle=tuple(inside.tolist()), deviation=tuple(deviation.tolist()), spans=spans)


@dataclass(frozen=True, kw_only=True)
class PinForm:
    """Roundness of a pin that does not turn in its groove: waves of its radius around it.

    Theory page equation (84); they count counter-clockwise from the direction towards the middle of the ring, where the
    discs touch it.
    """

    waves: tuple[tuple[int, float, float], ...]  # Order n, amplitudes of cos and sin [-, m, m]

    def at(self, direction: Float[np.ndarray, "*angles"]) -> Float[np.ndarray, "*angles"]:
        """Return how far the pin stands out in directions [rad], Σ a·cos nχ + b·sin nχ [m]."""
        found = np.zeros_like(direction)
        for order, cosine, sine in self.waves:
            found += cosine * np.cos(order * direction) + sine * np.sin(order * direction)
        return found


@dataclass(frozen=True, kw_only=True)
class PartForm:
    """Form of the parts of a reducer beyond the amounts of its modification, theory page equations (83) and (84)."""

    designed: FlankForm | None = None  # Of all discs, by their drawing
    # Number of a disc or pin, from 0 → what it has beyond its drawing
    discs: tuple[tuple[int, FlankForm], ...] = ()
    pins: tuple[tuple[int, PinForm], ...] = ()
    worn: FlankForm | None = None  # What wear has taken off all discs, inward negative

    @property
    def is_measured(self) -> bool:
        """Whether single discs or pins have a form of their own, so that no two are alike."""
        return bool(self.discs or self.pins)

    @property
    def drawn(self) -> PartForm | None:
        """What of it the drawing states, none if nothing."""
        return PartForm(designed=self.designed) if self.designed else None

    def of_flank(self, disc: int, angle: Float[np.ndarray, "*angles"]) -> Float[np.ndarray, "*angles"]:
        """Return how far the flanks of a disc stand out at angles φ that go on around it [m]."""
        found = np.zeros_like(angle)
        for form in (self.designed, self.worn, dict(self.discs).get(disc)):
            if form is not None:
                found += form.at(angle)
        return found

    def of_pins(self, direction: Float[np.ndarray, "*angles pin"]) -> Float[np.ndarray, "*angles pin"]:
        """Return how far every pin stands out in the direction in which it is touched [m]."""
        found = np.zeros_like(direction)
        for pin, form in self.pins:
            found[..., pin] = form.at(direction[..., pin])
        return found


def read_profile(path: Path, columns: Sequence[str], may: Sequence[str] = ()) -> Mapping[str, Points]:
    """Return a table of numbers by its columns: angles in rad, lengths in m, numbers without a unit as they are.

    Other columns may stand there, but need not.
    """
    table = read_text_table(path)
    stated = [split_header(header) for header in table.headers]
    names = [name for name, _ in stated]
    if sorted(name for name in names if name not in may) != sorted(columns) or len({*names}) < len(names):
        asked = ", ".join(columns) + "".join(f", and {name} if there is one" for name in may)
        raise InputError.at(path, "columns", ", ".join(names), asked)
    factors = []
    for name, unit in stated:
        allowed = _UNITS[name]
        if unit not in allowed:
            raise InputError.at(path, f"the unit of column {name!r}", unit or "missing", " or ".join(allowed) or "none")
        factors.append(allowed[unit])
    values = np.empty((len(table.rows), len(names)))
    for at, (row, cells) in enumerate(zip(table.rows, table.cells, strict=True)):
        for column, name in enumerate(names):
            values[at, column] = believed_number(f"{path}, row {row}", name, cells[column], float_info.max, "a number")
    return dict(zip(names, (values * factors).T, strict=True))


def load_designed(path: Path) -> FlankForm:
    """Return the free form of a drawing from a CSV file, columns ``phi [deg]`` from 0 to 180 and ``deviation [µm]``.

    It stands for both flanks of every tooth and adds to the amounts of the modification.
    """
    found = read_profile(path, ("phi", "deviation"))
    angle, deviation = found["phi"], found["deviation"]
    if angle.min() < 0 or angle.max() > pi + _CLOSE:
        beyond = angle.min() if angle.min() < 0 else angle.max()
        raise InputError.at(
            path, "phi [deg]", float(f"{beyond / DEGREE:.6g}"), "0° in the middle of a tooth space to 180° at the tip"
        )
    if (most := float(np.abs(deviation).max())) > LARGEST_FREE:
        raise InputError.at(path, "largest deviation [µm]", float(f"{most * 1e6:.4g}"), f"up to {LARGEST_FREE * 1e6:g}")
    return flank_form(np.append(angle, -angle), np.tile(deviation, 2), 1, 0, str(path))
