"""Load cases: conditions under which outputs are limited beside those in force, and the names of outputs there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass
from math import isfinite
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np
from jaxtyping import Float

from tolalloc.drawings.table_file import read_rows
from tolalloc.exceptions import InputError
from tolalloc.reading.files import Record
from tolalloc.reading.named_fields import NamedFields, Rule, is_number, number, or_none
from tolalloc.reading.units import DEGREE
from tolalloc.reducers import EFFICIENCY, PEAK_TO_PEAK, RADIAL_CLEARANCE, TORSIONAL_STIFFNESS
from tolalloc.reducers.settings import TEMPERATURE, is_range

_RATED = ", rated torque"
"""What an output is called whose load is the rated torque, unless a load case states another."""
_LEAST_IS_WORST = (TORSIONAL_STIFFNESS, EFFICIENCY, RADIAL_CLEARANCE)
"""Outputs of which less is worse."""
_WORST, _MEAN, _CHANGE = "worst load case", "mean of load cases", "less in force"
"""What is said of an output over load cases."""
_NAME = Rule(
    f"a short name without brackets and commas, such as 'warm', and none of '{_WORST}', '{_MEAN}', 'rated torque' and "
    f"'… {_CHANGE}'",
    lambda value: (
        isinstance(value, str)
        and bool(value.strip())
        and not {*"[],"} & {*value}
        and value not in (_WORST, _MEAN, _RATED[2:])
        and not value.endswith(_CHANGE)
    ),
)
_TORQUE = Rule("a torque in N·m, but not 0", lambda value: is_number(value) and isfinite(value) and value != 0)
_WINDOW = Rule(
    "two angles of the output in degrees, the smaller one first and at most a turn apart, such as (-90, 90)",
    lambda value: is_range(value, 360.0) and 0 < value[1] - value[0] <= 360,
)
_ORDERS = Rule(
    "whole orders of the output's turn from 1 to 200, such as (1, 2)",
    lambda value: (
        isinstance(value, tuple | list)
        and all(isinstance(own, int) and not isinstance(own, bool) and 1 <= own <= 200 for own in value)
        and len({*value}) == len(value)
    ),
)
_UNITS = {"torque": "N·m", "speed": "rpm", "share": "%", "disc_temperature": "K", "moment": "N·m"}


@dataclass(frozen=True)
class LoadCase(NamedFields):
    """Conditions under which a reducer's outputs may be limited beside those of the study.

    What is not stated is as in the study.

    Parameters
    ----------
    name
        What outputs under it are called after.
    torque
        On the carrier, negative where it resists the rotation: of the transmission error, and of what pins and bearings
        carry in place of the rated torque; lost motion, backlash and stiffness have torques of their own [N·m].
    disc_temperature
        Of the discs less that of the ring [K].
    output_angles
        Part of the output turn within which the transmission error counts, all of it unless given [°].
    compensated
        Orders of the output's turn that a controller takes out of the transmission error, unit by unit, before it
        counts; none unless given.
    speed
        Of the output, which lives of bearings, wear and heat follow from [rpm].
    moment
        External moment across the output's axis, which the main bearing alone feels [N·m].
    share
        Share of the time, the shares of all load cases of any sum [-].
    hours
        Hours of turning after which everything is looked at, parts worn by those load cases that state a speed, each
        for its share of them; parts as new unless given [h].

    Examples
    --------
    Lost motion of cold discs is an output of its own, to be limited beside the others:

    >>> at("lost motion [arcmin]", LoadCase("cold", disc_temperature=-5.0))
    'lost motion, cold [arcmin]'
    """

    called: ClassVar[str] = "load case"
    by_position: ClassVar[int] = 1

    name: Annotated[str, _NAME]
    _: KW_ONLY
    torque: Annotated[float | None, or_none(_TORQUE)] = None
    disc_temperature: Annotated[float | None, or_none(TEMPERATURE)] = None
    output_angles: Annotated[tuple[float, float] | None, or_none(_WINDOW)] = None
    compensated: Annotated[tuple[int, ...], _ORDERS] = ()
    speed: Annotated[float | None, or_none(number("a speed in rpm above 0", above=0, most=1e4))] = None
    moment: Annotated[float, number("a moment in N·m")] = 0.0
    share: Annotated[float, number("a share of the time above 0", above=0, most=1e6)] = 1.0
    hours: Annotated[float | None, or_none(number("hours of turning, 0 or more", least=0, most=1e6))] = None

    @property
    def window(self) -> tuple[float, float] | None:
        """Part of the output turn within which the transmission error counts [rad]."""
        return None if self.output_angles is None else tuple(DEGREE * own for own in self.output_angles)  # type: ignore[return-value]

    @property
    def is_of_part(self) -> bool:
        """Whether a part of the transmission error counts, of the turn or of its orders."""
        return self.output_angles is not None or bool(self.compensated)

    def felt_by(self, output: str) -> bool:
        """Return whether an output may differ from that in force."""
        return (
            self.disc_temperature is not None
            or self.hours is not None
            or (self.torque is not None and (output == PEAK_TO_PEAK or _RATED in output))
            or (self.is_of_part and output == PEAK_TO_PEAK)
        )


def _split(place: str, output: Any) -> tuple[str, str]:
    """Return what an output is and its unit."""
    what, found, unit = output.rpartition(" [") if isinstance(output, str) else ("", "", "")
    if not found:
        raise InputError.of_argument(place, "output", output, "an output of a reducer, such as ta.PEAK_TO_PEAK")
    return what, unit


def at(output: str, case: LoadCase) -> str:
    """Return the name of an output under a load case of its own, to be limited beside the same under others.

    Parameters
    ----------
    output
        Output of a reducer, such as `PEAK_TO_PEAK`.
    case
        One of the ``load_cases`` of `reducer`.

    Raises
    ------
    InputError
        An output without a unit, or a load case that is none.
    """
    return _under("at", output, case, "")


def _under(place: str, output: Any, case: Any, further: str) -> str:
    what, unit = _split(place, output)
    if not isinstance(case, LoadCase):
        allowed = "a load case, such as ta.LoadCase('cold', disc_temperature=-5)"
        raise InputError.of_argument(place, "case", case, allowed)
    return f"{what.removesuffix(_RATED) if case.torque is not None else what}, {case.name}{further} [{unit}"


def change(output: str, case: LoadCase) -> str:
    """Return the name of what a load case adds to an output in force, such as wear to the lost motion of new parts.

    Raises
    ------
    InputError
        An output without a unit, or a load case that is none.
    """
    return _under("change", output, case, f" {_CHANGE}")


def worst(output: str) -> str:
    """Return the name of the worst of an output over the load cases of a reducer, unit by unit.

    The largest, but the least of stiffness, efficiency and radial clearance.

    Raises
    ------
    InputError
        An output without a unit.
    """
    return _over_all("worst", output, _WORST)


def mean(output: str) -> str:
    """Return the name of the mean of an output over the load cases of a reducer, weighted by their shares of the time.

    Raises
    ------
    InputError
        An output without a unit.
    """
    return _over_all("mean", output, _MEAN)


def _over_all(place: str, output: Any, said: str) -> str:
    what, unit = _split(place, output)
    return f"{what.removesuffix(_RATED)}, {said} [{unit}"


@dataclass(frozen=True, kw_only=True)
class OverLoadCases:
    """An output over several load cases: the worst of it, its mean weighted by shares of the time, or a change."""

    of: tuple[str, ...]  # Names of the output under every load case
    fixed: tuple[float, ...] | None  # What each counts, of a mean its share of the time; none of the worst [-]
    least: bool = False  # Whether less is worse

    def weights(self, values: Float[np.ndarray, "sample case"]) -> Float[np.ndarray, "sample case"]:
        """Return what every load case counts in a unit: its value is Σ weight·value, and so are its derivatives [-]."""
        if self.fixed is not None:
            return np.broadcast_to(self.fixed, values.shape)
        if not np.isfinite(values).all():
            values = np.nan_to_num(values, nan=0.0)  # a failed unit; its status keeps it out
        worst = values.argmin(axis=1) if self.least else values.argmax(axis=1)
        return np.asarray(np.eye(values.shape[1])[worst])


def combined_outputs(cases: Sequence[LoadCase], outputs: Sequence[str]) -> Mapping[str, OverLoadCases]:
    """Return what load cases change of every output, and its worst and mean over two or more, by their names."""
    found: dict[str, OverLoadCases] = {}
    for output in outputs:
        felt = [case for case in cases if case.felt_by(output)]
        found |= {
            change(output, case): OverLoadCases(of=(at(output, case), output), fixed=(1.0, -1.0)) for case in felt
        }
        if len(felt) > 1:
            names = tuple(at(output, case) for case in felt)
            together = sum(case.share for case in felt)
            found[worst(output)] = OverLoadCases(of=names, fixed=None, least=output in _LEAST_IS_WORST)
            found[mean(output)] = OverLoadCases(of=names, fixed=tuple(case.share / together for case in felt))
    return found


def require_load_cases(place: str, cases: Any) -> tuple[LoadCase, ...]:
    """Return the load cases of a reducer."""
    good = isinstance(cases, Sequence) and all(isinstance(case, LoadCase) for case in cases)
    if not good:
        allowed = "a list of load cases, such as [ta.LoadCase('warm', disc_temperature=5)]"
        raise InputError.of_argument(place, "load_cases", cases, allowed)
    for case in cases:
        if case.compensated and case.output_angles:
            raise InputError.of_argument(place, "compensated", case.compensated, "orders, or output_angles: not both")
    names = [case.name for case in cases]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise InputError.of_argument(place, "load_cases", twice, "names that differ")
    if any(case.hours for case in cases):
        require_duty(place, cases)
    return tuple(cases)


class CycleRow(Record):
    """A row of a duty cycle's file."""

    case: str
    torque: float
    speed: float
    share: float
    disc_temperature: float | None = None
    moment: float | None = None


def load_cycle(path: Path) -> tuple[LoadCase, ...]:
    """Return the load cases of a duty cycle's file, a CSV of ``case,torque [N·m],speed [rpm],share [%]``.

    A column ``disc_temperature [K]`` and one ``moment [N·m]`` may stand there too.
    """
    cases = []
    for place, row in read_rows(path, CycleRow, "case", _UNITS):
        stated = {name: value for name, value in row.model_dump().items() if name != "case" and value is not None}
        try:
            cases.append(LoadCase(row.case, **stated))
        except InputError as error:
            raise InputError(f"{place}: {error}") from None
    return require_load_cases(str(path), cases)


def require_duty(place: str, cases: Sequence[LoadCase]) -> tuple[LoadCase, ...]:
    """Return those that state a speed: the duty cycle that wears a reducer."""
    duty = tuple(case for case in cases if case.speed is not None)
    if not duty:
        allowed = "a list in which one states the speed that wears, such as ta.LoadCase('work', torque=-167, speed=15)"
        raise InputError.of_argument(place, "load_cases", [case.name for case in cases], allowed)
    return duty
