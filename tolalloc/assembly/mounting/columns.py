"""From a part's own errors to the columns of the model, where it stands and as it is turned, and back."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from math import cos, sin

from tolalloc.assembly.mounting.places import Place, Turn

_WAVE = re.compile(r"(.*)\.(cos|sin)(\d+)")
_MEMBER = re.compile(r"(each_(?:pin|tooth)\.\w+)\.(\d+)(.*)")
_BORE = re.compile(r"\bbore(\d+)\b")


def own_name(column: str, place: Place) -> str | None:
    """Return the own name of the error that a column of the model stands for at a place, none if it is not there."""
    return next((own + column[len(model) :] for model, own in place.owned if column.startswith(model)), None)


def model_name(error: str, place: Place) -> str:
    """Return the column of the model that an error in its own name is at a place."""
    return next(model + error[len(own) :] for model, own in place.owned if error.startswith(own))


def owned_columns(columns: Iterable[str], places: Iterable[Place]) -> tuple[str, ...]:
    """Return the columns that some part at one of the places has."""
    taken = tuple(places)
    return tuple(name for name in columns if any(own_name(name, place) is not None for place in taken))


def _terms(error: str, turn: Turn) -> tuple[tuple[str, float], ...]:
    """Return the errors that an error becomes by a turn, and its share in each [-].

    Notes
    -----
    A wave f(θ) becomes f(θ − turn), and its two amplitudes turn as a vector does, by its order times the angle. The
    place of a single pin is counted radially and tangentially, so it keeps its components.
    """
    name = _BORE.sub(lambda bore: f"bore{turn.bores.moved(int(bore[1]))}", error)
    if member := _MEMBER.fullmatch(name):
        return ((f"{member[1]}.{turn.ring.moved(int(member[2]))}{member[3]}", 1.0),)
    if wave := _WAVE.fullmatch(name):
        angle, order = int(wave[3]) * turn.ring.angle, wave[3]
        ahead, behind = f"{wave[1]}.cos{order}", f"{wave[1]}.sin{order}"
    elif name.endswith((".x", ".y")):
        angle, ahead, behind = turn.direction, f"{name[:-1]}x", f"{name[:-1]}y"
    else:
        return ((name, 1.0),)
    if angle == 0.0:
        return ((name, 1.0),)
    return (
        ((ahead, cos(angle)), (behind, sin(angle))) if name == ahead else ((ahead, -sin(angle)), (behind, cos(angle)))
    )


def turned(errors: Mapping[str, float], turn: Turn) -> dict[str, float]:
    """Return the errors of a turned part, still in its own names [m, angles rad]."""
    found: dict[str, float] = {}
    for error, value in errors.items():
        for name, share in _terms(error, turn):
            found[name] = found.get(name, 0.0) + share * value
    return found


def mounted(errors: Mapping[str, float], place: Place, turn: Turn) -> dict[str, float]:
    """Return the columns of the model that a part's own errors give [m, angles rad].

    Parameters
    ----------
    errors
        Error in the part's own name → deviation in its own frame [m, angles rad].
    place, turn
        Where the part stands, and how it is turned there.

    Notes
    -----
    Exact: the columns are linear in the errors, and a unit is the sum over its parts.
    """
    return {model_name(error, place): value for error, value in turned(errors, turn).items()}


def unmounted(deviations: Mapping[str, float], place: Place, turn: Turn) -> dict[str, float]:
    """Return the own errors of the part that gives these columns of the model at a place [m, angles rad].

    Parameters
    ----------
    deviations
        Column of the model → deviation; columns of other places are passed over [m, angles rad].
    place, turn
        Where the part stands, and how it is turned there.
    """
    named = ((own_name(column, place), value) for column, value in deviations.items())
    return turned({name: value for name, value in named if name is not None}, turn.back)
