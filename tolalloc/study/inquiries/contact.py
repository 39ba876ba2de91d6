"""What a tooth modification does to clearance and contact, and its profile in a file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from tolalloc.exceptions import UnknownNameError
from tolalloc.reading.named_fields import number, or_none, whole
from tolalloc.reading.units import MICROMETRE, MILLIMETRE
from tolalloc.reports.header import Header
from tolalloc.running.progress import Progress
from tolalloc.study.answer import Answer
from tolalloc.study.inquiry import Inquiry, RatedTorque, ReducerName, Word

if TYPE_CHECKING:
    from tolalloc.reducers.contact import ContactResult
    from tolalloc.reducers.cycloid.tooth_profile import ToothProfile
    from tolalloc.reducers.reducer.design import Reducer

ProfileFile = Annotated[Path | None, Word("Write the tooth profile to this new .csv or .dxf file.")]
ProfilePoints = Annotated[int, Word("Points per tooth of that file.")]
MOST_PHASES = 3600
"""Most phases of the crank within one pin pitch [-]."""


@dataclass(frozen=True, kw_only=True)
class ToothContact(Inquiry["tuple[Reducer, float]"]):
    """Compute clearance, backlash, pins in contact, forces and pressure of exact parts."""

    word: ClassVar[str] = "contact"
    example: ClassVar[str] = "tolalloc contact --reducer mine/reducer.toml"
    kernel: ClassVar[Literal["", "equivalent"]] = "equivalent"
    written: ClassVar[tuple[str, ...]] = ("profile",)

    reducer: ReducerName = None
    torque: RatedTorque = None
    width: Annotated[
        float | None, Word("Loaded face width [mm]."), or_none(number("0.5 to 200 mm", least=0.5, most=200))
    ] = None
    support: Annotated[
        float | None,
        Word("Distance between the two supports of a bending pin [mm]."),
        or_none(number("1 to 500 mm between two supports", least=1, most=500)),
    ] = None
    law: Annotated[str, Word("Contact law: logarithmic (Hertz), constant, table2.")] = "logarithmic"
    exact: Annotated[bool, Word("Use exact distances even for a small modification.", option="--exact")] = False
    phases: Annotated[
        int, Word("Phases of the crank within one pin pitch."), whole(f"1 to {MOST_PHASES}", 1, MOST_PHASES)
    ] = 72
    profile: ProfileFile = None
    points: ProfilePoints = 200

    def prepare(self) -> tuple[Reducer, float]:
        """Return the design with the width and support that were asked for, and the torque on the carrier [N·m]."""
        from tolalloc.reducers.cycloid.solvers import LAWS
        from tolalloc.reducers.reducer.files import load_reducer

        require_profile(self.profile, self.points)
        design = load_reducer(str(self.reducer))
        if self.width is not None:
            design = design.with_face_width(self.width * MILLIMETRE)
        if self.support is not None:
            design = design.with_pin_span(self.support * MILLIMETRE)
        UnknownNameError.require(self.called, "contact law", self.law, LAWS)
        torque = -design.load.rated_torque if self.torque is None else self.torque
        return design, design.torque_on_carrier(torque, self.called)

    def solve(self, prepared: tuple[Reducer, float], progress: Progress) -> Answer[ContactResult]:  # noqa: ARG002
        """Return clearance and contact."""
        from tolalloc.reducers.contact import contact_of

        design, torque = prepared
        result = contact_of(design, torque, law=self.law, exact=True if self.exact else None, phases=self.phases)
        conditions = {"torque on the carrier [N·m]": torque}
        header = Header(
            name=design.name, model=design.name, conditions=conditions, assumptions=result.assessment.assumptions
        )
        return Answer(kind="contact", header=header, result=result)

    def write(self, answer: Answer[Any]) -> tuple[str, ...]:
        """Write the tooth profile if it was asked for."""
        return written_profile(answer.result.assessment.profile, self.points, self.profile)


def require_profile(file: Path | None, points: int) -> None:
    """Refuse a profile that could not be written, before anything long runs."""
    if file:
        from tolalloc.reports.drawing_files import require_profile_file

        require_profile_file(file, points)


def written_profile(teeth: ToothProfile, points: int, file: Path | None) -> tuple[str, ...]:
    """Write the profile if it was asked for, and return a sentence on it."""
    if not file:
        return ()
    from tolalloc.reports.drawing_files import write_profile

    made = write_profile(teeth, points, file)
    error = f"{made.chord_error / MICROMETRE:.2g} µm"
    return (f"Profile: {file}, {made.per_tooth} points per tooth, chord error at most {error}.",)
