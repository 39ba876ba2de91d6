"""Which reducer a study asks, under which torque and with which stiffness: ``ta.reducer``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from tolalloc.drawings.error_model import ErrorModel
from tolalloc.exceptions import InputError
from tolalloc.rv.bound import NEGLECTED, bind
from tolalloc.rv.reducer.design import Reducer
from tolalloc.rv.reducer.files import load_identified_stiffness, load_reducer, with_stiffness
from tolalloc.rv.reducer.stiffness import IdentifiedStiffness
from tolalloc.rv.reducer.unit_file import BuiltUnit, load_unit
from tolalloc.units import MICROMETRE

if TYPE_CHECKING:
    from tolalloc.rv.model import ReducerModel

_FARTHEST = 50.0
"""Largest clearance that a modification may be asked to leave, either way [µm]."""


@dataclass(frozen=True, kw_only=True)
class ReducerChoice:
    """A reducer as a study names it; it becomes a `tolalloc.rv.model.ReducerModel` with the study's drawing."""

    reducer: Reducer  # The reducer with the stiffness in use
    identified: IdentifiedStiffness | None = None  # Identified stiffnesses that replaced its own, if any
    # Torque on the carrier, negative where it resists the rotation; the reducer's test torque unless given [N·m]
    torque: float | None = None
    # Smallest and largest nominal clearance that the tooth modification may leave on the flank, and at tip and root
    # [µm]
    flank_clearance: tuple[float, float] | None = None
    radial_clearance: tuple[float, float] | None = None  # As they are unless given [µm]
    # Sources that a drawing may leave out, taken as zero; ``*`` stands for anything
    neglected: tuple[str, ...] = NEGLECTED
    unit: BuiltUnit | None = None  # Built unit whose curve is shown, if any

    @property
    def name(self) -> str:
        """The reducer's."""
        return self.reducer.name

    def bound(self, errors: ErrorModel, place: str) -> ReducerModel:
        """Return the model at the sources of a drawing; nothing is solved.

        Raises
        ------
        InputError, UnknownNameError
            A source or torque that is not allowed, or a column of the model that nobody gives.
        """
        from tolalloc.rv.model import ReducerModel

        found = bind(self.reducer, errors, self.torque, place, self.neglected, self.unit)
        flank, radial = (
            (own[0] * MICROMETRE, own[1] * MICROMETRE) if own else None
            for own in (self.flank_clearance, self.radial_clearance)
        )
        return ReducerModel(
            kernel=found.kernel,
            flank=flank,
            radial=radial,
            identified=self.identified,
            unit=self.unit,
            bound_assumptions=found.assumptions,
        )


def reducer(
    name: str | Path,
    *,
    stiffness: str | Path = "",
    torque: float | None = None,
    flank_clearance: tuple[float, float] | None = None,
    radial_clearance: tuple[float, float] | None = None,
    neglected: tuple[str, ...] = NEGLECTED,
    unit: str | Path = "",
) -> ReducerChoice:
    """Return a reducer for a study, from a preset or a TOML file.

    Parameters
    ----------
    name
        Preset, such as ``rv20e``, or path of a reducer file.
    stiffness
        Identified stiffnesses that replace its own, by shipped name or path.
    torque
        Torque on the carrier, negative where it resists the rotation; the reducer's test torque unless given [N·m].
    flank_clearance, radial_clearance
        Smallest and largest nominal clearance that the tooth modification may leave on the flank, and at tip and root;
        as they are unless given [µm].
    neglected
        Sources that a drawing may leave out, taken as zero; ``*`` stands for anything.
    unit
        Built unit whose curve is shown, by shipped name or path.

    Raises
    ------
    InputError, UnknownNameError
        The file, field and value that are not allowed.

    Examples
    --------
    >>> reducer("rv20e", stiffness="rv20e_table6").reducer.crank_count
    2
    """
    for field, own in (("flank_clearance", flank_clearance), ("radial_clearance", radial_clearance)):
        if own is not None and not (len(own) == 2 and -_FARTHEST <= own[0] <= own[1] <= _FARTHEST):
            raise InputError.at(f"reducer {name}", field, own, "two numbers from -50 to 50 µm, the smaller one first")
    chosen = load_reducer(name)
    identified = load_identified_stiffness(stiffness) if stiffness else None
    return ReducerChoice(
        reducer=with_stiffness(chosen, identified) if identified else chosen,
        identified=identified,
        torque=torque,
        flank_clearance=flank_clearance,
        radial_clearance=radial_clearance,
        neglected=tuple(neglected),
        unit=load_unit(unit) if unit else None,
    )
