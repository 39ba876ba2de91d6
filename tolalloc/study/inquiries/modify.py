"""Equidistant and shift amount that leave wanted clearances, or by a published method."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, cast

from tolalloc.exceptions import InputError
from tolalloc.reading.units import MICROMETRE
from tolalloc.reports.header import Header
from tolalloc.running.progress import Progress
from tolalloc.study.answer import Answer
from tolalloc.study.inquiries.contact import ProfileFile, ProfilePoints, require_profile, written_profile
from tolalloc.study.inquiry import Inquiry, RatedTorque, ReducerName, Word

if TYPE_CHECKING:
    from tolalloc.reducers.modification import Metric, ModificationRequest, ModificationResult
    from tolalloc.reducers.reducer.design import Reducer


@dataclass(frozen=True, kw_only=True)
class Modify(Inquiry["tuple[ModificationRequest, Reducer, float]"]):
    """Choose equidistant and shift amount for wanted clearances or by a published objective; show what they deliver."""

    word: ClassVar[str] = "modify"
    example: ClassVar[str] = "tolalloc modify --flank 3.5 --radial 8 --reducer mine/reducer.toml"
    by_position: ClassVar[int] = 1
    kernel: ClassVar[Literal["", "equivalent"]] = "equivalent"
    written: ClassVar[tuple[str, ...]] = ("profile", "write_to")

    method: Annotated[
        str, Word("clearances (those wanted), song2019 (towards a rotated profile) or li2018 (least gap).")
    ] = "clearances"
    reducer: ReducerName = None
    flank: Annotated[float | None, Word("clearances: wanted on the flank [µm]; 3.5 unless given.")] = None
    radial: Annotated[
        float | None,
        Word("At tip and root [µm]: for clearances wanted, 8 unless given; else the smallest, 15 unless given."),
    ] = None
    rotation: Annotated[float, Word("song2019: rotation of the profile to come close to [rad].")] = 0.005
    metric: Annotated[str, Word("song2019: same_angle, normal or nearest.")] = "same_angle"
    negative: Annotated[bool, Word("song2019: a negative shift.", option="--negative-shift")] = False
    require_gap: Annotated[bool, Word("song2019: no interference after closing.", option="--require-gap")] = False
    torque: RatedTorque = None
    profile: ProfileFile = None
    points: ProfilePoints = 200
    write_to: Annotated[Path | None, Word("New reducer file to write, with these amounts.", option="--write")] = None

    def prepare(self) -> tuple[ModificationRequest, Reducer, float]:
        """Return what is chosen, on which design, and the torque on the carrier [N·m]."""
        from tolalloc.reading.files import require_new
        from tolalloc.reducers.modification import (
            BUILDABLE_FLANK,
            BUILDABLE_RADIAL,
            PUBLISHED_RADIAL,
            ModificationRequest,
        )
        from tolalloc.reducers.reducer.files import load_reducer

        wanted = self.method == "clearances"
        if self.flank is not None and not wanted:
            raise InputError.of_argument(
                self.called, "flank", f"{self.flank:g} µm", f"none with {self.method}, which chooses it by itself"
            )
        radial = BUILDABLE_RADIAL if wanted else PUBLISHED_RADIAL
        request = ModificationRequest(
            method=self.method,
            flank_clearance=BUILDABLE_FLANK if self.flank is None else self.flank * MICROMETRE,
            radial_clearance=radial if self.radial is None else self.radial * MICROMETRE,
            rotation=self.rotation,
            metric=cast("Metric", self.metric),
            shift_sign=-1 if self.negative else 1,
            require_gap=self.require_gap,
        )
        require_profile(self.profile, self.points)
        if self.write_to:
            require_new(self.write_to)
        design = load_reducer(str(self.reducer))
        torque = -design.load.rated_torque if self.torque is None else self.torque
        return request, design, design.torque_on_carrier(torque, self.called)

    def solve(
        self,
        prepared: tuple[ModificationRequest, Reducer, float],
        progress: Progress,  # noqa: ARG002
    ) -> Answer[ModificationResult]:
        """Return the amounts and what they do."""
        from tolalloc.reducers.modification import choose

        return answer_of(choose(*prepared))

    def write(self, answer: Answer[Any]) -> tuple[str, ...]:
        """Write the tooth profile and the reducer with these amounts, if they were asked for."""
        from tolalloc.reducers.reducer.files import write_modified

        said = written_profile(answer.result.contact.assessment.profile, self.points, self.profile)
        if not self.write_to:
            return said
        write_modified(str(self.reducer), answer.result.best.modification, self.write_to)
        return (*said, f"The reducer with these amounts is {self.write_to}.")


def answer_of(result: ModificationResult) -> Answer[ModificationResult]:
    """Return the answer of a choice, whose header names the method."""
    conditions = {"torque on the carrier [N·m]": result.contact.torque}
    header = Header(name=result.request.method, model=result.reducer.name, conditions=conditions)
    return Answer(kind="modification", header=header, result=result)
