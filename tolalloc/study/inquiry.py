"""Questions that need no study: one record each, asked by a function of ``ta`` and by a command of the same name."""

from __future__ import annotations

import inspect
import os
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import cache
from numbers import Integral
from pathlib import Path
from typing import Annotated, Any, ClassVar, Generic, Literal, Self, TypeVar, get_args, get_type_hints

from tolalloc.exceptions import InputError
from tolalloc.reading.named_fields import NamedFields, is_number, whole
from tolalloc.running.progress import SILENT, Progress
from tolalloc.study.answer import Answer

Prepared = TypeVar("Prepared")
DEFAULT_REDUCER = "rv20e"
"""Preset of every inquiry that writes no file."""


@dataclass(frozen=True)
class Word:
    """What a command says of a field of an inquiry."""

    help: str  # What it is, with its unit
    option: str = ""  # Name of its option where it is not that of the field


ReducerName = Annotated[
    str | None,
    Word(f"Preset name or TOML file; {DEFAULT_REDUCER} unless given; required where a file is written."),
]
UnitName = Annotated[str, Word("Shipped unit (exact, table4 of an RV-20E) or TOML file.")]
StiffnessName = Annotated[str, Word("Identified stiffness: shipped name or TOML file.")]
TestTorque = Annotated[
    float | None,
    Word(
        "Torque on the carrier [N·m], negative where it resists the rotation; the reducer's test torque unless given."
    ),
]
RatedTorque = Annotated[
    float | None,
    Word("Torque on the carrier [N·m], negative where it resists the rotation; minus the rated one unless given."),
]


Neglected = Annotated[
    list[str] | None,
    Word("Further sources that the table may omit, a pattern such as '*'; repeatable."),
]

Seed = Annotated[int, Word("Seed of every random number."), whole("0 or a positive integer", 0)]
ProcessesName = Annotated[str, Word("Process capability library that rows of the table may name: shipped name or CSV.")]


@dataclass(frozen=True, kw_only=True)
class Inquiry(NamedFields, ABC, Generic[Prepared]):
    """A question that is asked without a study.

    A subclass names its command (``word``), and its fields are annotated with what the command says of them:
    ``Annotated[Path, Word("CSV: …")]``. Its first fields, ``by_position`` of them, are arguments of the command, all
    others options; its docstring is the command's help.
    """

    are_arguments: ClassVar[bool] = True
    word: ClassVar[str]
    """Its command and the function of ``ta``."""
    example: ClassVar[str]
    """Its command as typed in a folder that ``tolalloc new mine --with all`` made."""
    counted: ClassVar[str] = "units"
    """What its progress counts."""
    kernel: ClassVar[Literal["", "equivalent"]] = ""
    """Compiled room that it solves with, announced where it has not run on a machine; empty for none."""
    written: ClassVar[tuple[str, ...]] = ()
    """Fields that name files which it writes, for which the reducer must be named."""

    def __init_subclass__(cls) -> None:
        cls.called = f"tolalloc {getattr(cls, 'word', cls.__name__)}"

    def __post_init__(self) -> None:
        """Take every field as what its annotation says: a path also as text, a number also as a whole one."""
        for name, kind in _kinds(type(self)).items():
            object.__setattr__(self, name, _taken(self.called, name, kind, getattr(self, name)))
        super().__post_init__()

    @abstractmethod
    def prepare(self) -> Prepared:
        """Return what is solved, all files read and all values checked; nothing long runs."""

    def room(self, prepared: Prepared) -> str:  # noqa: ARG002
        """Return the compiled room that it solves with, empty for none."""
        return self.kernel

    def apart_from(self, report: Path | None) -> None:
        """Refuse files that must not stand in the folder of a report; nothing unless an inquiry says otherwise."""

    @abstractmethod
    def solve(self, prepared: Prepared, progress: Progress) -> Answer[Any]:
        """Return the answer."""

    def write(self, answer: Answer[Any]) -> tuple[str, ...]:  # noqa: ARG002
        """Write the files that it names beside the report, and return a sentence for each."""
        return ()

    def with_reducer(self, *written: Path | None, argument: str = "reducer") -> Self:
        """Return it with the default reducer if it asks for one and none is given.

        No file, of its own or of others that are written such as the report, is about a reducer that nobody named; a
        message says the argument, or the option of a command.
        """
        if getattr(self, "reducer", DEFAULT_REDUCER) is not None:
            return self
        if any(written) or any(getattr(self, name) for name in self.written):
            from tolalloc.reading.files import shipped_files
            from tolalloc.reducers.reducer.files import PRESETS

            presets = ", ".join(sorted(shipped_files(PRESETS, ".reducer.toml")))
            raise InputError(
                f"{argument} is missing: where a file is written the reducer must be named; allowed is a preset "
                f"({presets}) or a TOML file."
            )
        named: dict[str, Any] = {"reducer": DEFAULT_REDUCER}
        return replace(self, **named)

    def ask(self, progress: Progress | None = None) -> Answer[Any]:
        """Return the answer, the files that it names written."""
        asked = self.with_reducer()
        answer = asked.solve(asked.prepare(), progress or SILENT)
        asked.write(answer)
        return answer


@cache
def _kinds(inquiry: type[Inquiry[Any]]) -> dict[str, tuple[Any, ...]]:
    """Return what each field may be."""
    hints = get_type_hints(inquiry)
    return {own.name: get_args(hints[own.name]) or (hints[own.name],) for own in fields(inquiry)}


def _taken(place: str, name: str, kinds: tuple[Any, ...], value: Any) -> Any:
    """Return the value of a field as one of its kinds; a kind that no command line knows is taken as it is."""
    if value is None and type(None) in kinds:
        return value
    for kind, takes, make, allowed in (
        (bool, isinstance(value, bool), bool, "True or False"),
        (int, isinstance(value, Integral) and not isinstance(value, bool), int, "a whole number"),
        (float, is_number(value), float, "a number"),
        (Path, isinstance(value, str | os.PathLike), Path, "a path"),
        (str, isinstance(value, str | os.PathLike), os.fspath, "a text"),
        (list[str], isinstance(value, list | tuple), list, "a list of texts"),
    ):
        if kind in kinds:
            if not takes:
                raise InputError.of_argument(place, name, value, allowed)
            return make(value)
    return value


def door(inquiry: type[Inquiry[Any]]) -> Callable[..., Answer[Any]]:
    """Return the function that asks an inquiry: its fields are the arguments, its docstring the function's."""

    def ask(*given: Any, progress: Progress | None = None, **named: Any) -> Answer[Any]:
        places = [own.name for own in fields(inquiry)][: inquiry.by_position]
        try:
            if len(given) > len(places):
                inquiry(*given, **named)  # the record refuses it, and says which field stands without its name
            return inquiry(**dict(zip(places, given, strict=False)), **named).ask(progress)
        except InputError as error:
            field = error.named_among(own.name for own in fields(inquiry))
            raise (error.as_option(f"ta.{inquiry.word}", field) if field else error) from None

    hints = get_type_hints(inquiry)
    parameters = [
        own.replace(kind=own.POSITIONAL_OR_KEYWORD if at < inquiry.by_position else own.kind, annotation=hints[name])
        for at, (name, own) in enumerate(inspect.signature(inquiry).parameters.items())
    ]
    ask.__name__ = ask.__qualname__ = inquiry.word
    ask.__doc__ = inquiry.__doc__
    ask.__signature__ = inspect.Signature(parameters, return_annotation=Answer)  # type: ignore[attr-defined]
    return ask
