"""Cells of tolerance tables and process capability libraries: from text to numbers, and back."""

from __future__ import annotations

import re
from collections.abc import Mapping
from enum import StrEnum
from math import sqrt
from typing import get_args

from tolalloc.drawing.distributions import SHAPES, Distribution
from tolalloc.drawing.mixtures import Batch
from tolalloc.drawing.zones import Spectrum
from tolalloc.exceptions import InputError
from tolalloc.files import Record

FEWEST_TEETH, MOST_TEETH = 4, 400
"""Teeth between which a random spectrum is believed; their spectrum has half as many orders [-]."""

_NUMBER = r"\d+(?:\.\d*)?(?:e-?\d+)?"


def typed_cells(model: type[Record], row: Mapping[str, str], place: str) -> dict[str, object]:
    """Return the cells of a row that are not empty, each as the type that its field asks for.

    Raises
    ------
    InputError
        The field and value that are not allowed.
    """
    return {
        str(header): _typed(model.model_fields[str(header)].annotation, str(header), str(text).strip(), place)
        for header, text in row.items()
        if str(text).strip()
    }


def _typed(annotation: object, header: str, value: str, place: str) -> object:
    if annotation is int:
        if not value.isdecimal():
            raise InputError.at(place, header, value, "a whole number, 1 or more")
        return int(value)
    if annotation is bool:
        answers = {"yes": True, "no": False, "true": True, "false": False}
        if value.lower() not in answers:
            raise InputError.at(place, header, value, "yes or no")
        return answers[value.lower()]
    if annotation is float or float in get_args(annotation):
        try:
            return float(value)
        except ValueError:
            raise InputError.at(place, header, value, "a number with a decimal point") from None
    if isinstance(annotation, type) and issubclass(annotation, StrEnum):
        if value not in list(annotation):
            more = "; a truncated one is written as its distribution with sorted = yes" if value == "truncated" else ""
            raise InputError.at(place, header, value, "one of " + ", ".join(annotation) + more)
        return annotation(value)
    return value


def require_shape(distribution: Distribution, shape: float | None) -> None:
    """Raise unless a distribution has the shape that it needs, and no other has one.

    Raises
    ------
    ValueError
        What is wrong, for the record that holds both.
    """
    if distribution not in SHAPES:
        if shape is not None:
            raise ValueError(f"distribution {distribution.value} has no shape; {' and '.join(SHAPES)} have one")
        return
    smallest, largest = SHAPES[distribution]
    if shape is None or not smallest <= shape <= largest:
        stated = "none" if shape is None else f"{shape:g}"
        raise ValueError(f"distribution {distribution.value} needs a shape from {smallest:g} to {largest:g}: {stated}")


def parsed_spectrum(text: str) -> tuple[Spectrum, int]:
    """Return a spectrum such as ``1:9.2 2:4.3 random:1.0/40`` and the number of its random teeth, or 0.

    Raises
    ------
    ValueError
        The text does not read like that.

    Notes
    -----
    Independent deviations of Z teeth with standard deviation σ are white noise: both waves of every order up to
    (Z − 1)/2 have the variance 2σ²/Z. Of order Z/2, for an even number, the teeth see one wave only, in what phase
    depends on where the angle is counted from; both get σ²/Z. The mean of all teeth is no deviation of pitch or
    run-out and is left out. The random part adds to a named order in quadrature.
    """
    amplitudes: dict[int, float] = {}
    teeth, random = 0, 0.0
    for item in text.split():
        if pair := re.fullmatch(rf"(\d+):({_NUMBER})", item):
            order, amplitude = int(pair[1]), float(pair[2])
            if order < 1 or amplitude <= 0 or order in amplitudes:
                raise ValueError(f"the spectrum's {item} must be an order from 1 up, each once, with more than 0 of it")
            amplitudes[order] = amplitude
        elif (noise := re.fullmatch(rf"random:({_NUMBER})/(\d+)", item)) and not teeth:
            random, teeth = float(noise[1]), int(noise[2])
            if random <= 0 or not FEWEST_TEETH <= teeth <= MOST_TEETH:
                raise ValueError(
                    f"the spectrum's {item} must have more than 0 of it on {FEWEST_TEETH} to {MOST_TEETH} teeth"
                )
        else:
            raise ValueError(
                "the spectrum must read like '1:9.2 2:4.3 4:1.0' (order:amplitude), with at most one random part like "
                "'random:1.0/40' (standard deviation/teeth)"
            )
    if teeth and max(amplitudes, default=0) > teeth // 2:
        raise ValueError(f"the spectrum's highest order must be {teeth // 2} or less, all that {teeth} teeth see")
    for order in range(1, teeth // 2 + 1):
        variance = random**2 * (1.0 if 2 * order == teeth else 2.0) / teeth
        amplitudes[order] = sqrt(amplitudes.get(order, 0.0) ** 2 + variance)
    return tuple(sorted(amplitudes.items()) if teeth else amplitudes.items()), teeth


def spectrum_text(spectrum: Spectrum) -> str:
    """Return a spectrum as a tolerance table writes it."""
    return " ".join(f"{order}:{amplitude!r}" for order, amplitude in spectrum)


def parsed_batches(text: str) -> tuple[Batch, ...]:
    """Return batches such as ``0.7:-0.3:0.8 0.3:0.5:0.6``: weight, shift and spread.

    Raises
    ------
    ValueError
        The text does not read like that.
    """
    batches = []
    for item in text.split():
        match = re.fullmatch(rf"({_NUMBER}):(-?{_NUMBER}):({_NUMBER})", item)
        if match is None:
            raise ValueError("the batches must read like '0.7:-0.3:0.8 0.3:0.5:0.6' (weight:shift:spread)")
        batch = Batch(weight=float(match[1]), shift=float(match[2]), spread=float(match[3]))
        if batch.weight <= 0 or abs(batch.shift) > 2 or not 0.01 <= batch.spread <= 10:
            raise ValueError(f"the batch {item} must have a weight above 0, shift -2 to 2, spread 0.01 to 10")
        batches.append(batch)
    return tuple(batches)


def batches_text(batches: tuple[Batch, ...]) -> str:
    """Return batches as a tolerance table writes them."""
    return " ".join(f"{batch.weight!r}:{batch.shift!r}:{batch.spread!r}" for batch in batches)
