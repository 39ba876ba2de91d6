"""The answer of ``tolalloc contact``: what a modification does to clearance and contact."""

from __future__ import annotations

from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.rv.cycloid.assessment import Assessment, assess
from tolalloc.rv.cycloid.solvers.contact_law import LAWS
from tolalloc.rv.reducer.design import Reducer
from tolalloc.units import MILLIMETRE

MOST_PHASES = 3600


def asked_reducer(reducer: Reducer, width_mm: float | None, support_mm: float | None) -> Reducer:
    """Return the reducer with the face width and the support of the pins that were asked for.

    Parameters
    ----------
    reducer
        Nominal design.
    width_mm
        Loaded face width; the reducer's own unless given [mm].
    support_mm
        Distance of two supports between which pins bend; the reducer's own support unless given [mm].

    Raises
    ------
    InputError
        Not a width or a span of a reducer.
    """
    place = "tolalloc contact"
    if width_mm is not None:
        if not 0.5 <= width_mm <= 200:
            raise InputError.at(place, "--width", width_mm, "0.5 to 200 mm")
        reducer = reducer.with_face_width(width_mm * MILLIMETRE)
    if support_mm is not None:
        if not 1 <= support_mm <= 500:
            raise InputError.at(place, "--support", support_mm, "1 to 500 mm between two supports")
        reducer = reducer.with_pin_span(support_mm * MILLIMETRE)
    return reducer


def contact_answer(reducer: Reducer, torque: float | None, law: str, exact: bool, phases: int) -> Assessment:
    """Return the assessment that was asked for, at the rated torque unless one is given.

    Parameters
    ----------
    reducer
        Nominal design.
    torque
        Torque on the carrier [N·m].
    law
        Contact law of the pins.
    exact
        Whether to take exact distances even where the linear formula would do.
    phases
        Phases of the pin pitch [-].

    Raises
    ------
    InputError, UnknownNameError
        What is not allowed.
    """
    place = "tolalloc contact"
    if law not in LAWS:
        raise UnknownNameError.among(place, "contact law", law, LAWS)
    if not 1 <= phases <= MOST_PHASES:
        raise InputError.at(place, "--phases", phases, f"1 to {MOST_PHASES}")
    asked = reducer.torque_on_carrier(reducer.load.rated_torque if torque is None else torque, place)
    return assess(reducer, asked, law=law, exact=True if exact else None, phases=phases)
