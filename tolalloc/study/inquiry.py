"""Questions that need no study: one record each, asked by a function of ``ta`` and by a command of the same name."""

from __future__ import annotations

import inspect
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import MISSING, dataclass, fields
from typing import Any, ClassVar, Generic, Literal, TypeVar, get_type_hints

from tolalloc.reading.named_fields import NamedFields
from tolalloc.running.progress import Progress, Silent
from tolalloc.study.answer import Answer

Prepared = TypeVar("Prepared")


@dataclass(frozen=True)
class Word:
    """What a command says of a field of an inquiry.

    Parameters
    ----------
    help
        What it is, with its unit.
    option
        Name of its option where it is not that of the field.
    """

    help: str
    option: str = ""


@dataclass(frozen=True, kw_only=True)
class Inquiry(NamedFields, ABC, Generic[Prepared]):
    """A question that is asked without a study.

    A subclass names its command (``word``), and its fields are annotated with what the command says of them:
    ``Annotated[Path, Word("CSV: …")]``. Its first fields, ``by_position`` of them, are arguments of the command, all
    others options; its docstring is the command's help.
    """

    word: ClassVar[str]
    """Its command and the function of ``ta``."""
    counted: ClassVar[str] = "units"
    """What its progress counts."""
    kernel: ClassVar[Literal["", "equivalent", "cycloid"]] = ""
    """Compiled room that it solves with, announced where it has not run on a machine; empty for none."""
    written: ClassVar[tuple[str, ...]] = ()
    """Fields that name files which it writes, for which the reducer must be named."""

    def __init_subclass__(cls) -> None:
        cls.called = f"tolalloc {getattr(cls, 'word', cls.__name__)}"

    @abstractmethod
    def prepare(self) -> Prepared:
        """Return what is solved, all files read and all values checked; nothing long runs.

        Raises
        ------
        TolallocError
            One sentence on what is wrong.
        """

    @abstractmethod
    def solve(self, prepared: Prepared, progress: Progress) -> Answer[Any]:
        """Return the answer."""

    def write(self, answer: Answer[Any]) -> tuple[str, ...]:  # noqa: ARG002
        """Write the files that it names beside the report, and return a sentence for each."""
        return ()

    def ask(self, progress: Progress | None = None) -> Answer[Any]:
        """Return the answer, the files that it names written."""
        answer = self.solve(self.prepare(), progress or Silent())
        self.write(answer)
        return answer


def door(inquiry: type[Inquiry[Any]]) -> Callable[..., Answer[Any]]:
    """Return the function that asks an inquiry: its fields are the arguments, its docstring the function's."""

    def ask(*given: Any, progress: Progress | None = None, **named: Any) -> Answer[Any]:
        places = [own.name for own in fields(inquiry)][: inquiry.by_position]
        return inquiry(**dict(zip(places, given, strict=False)), **named).ask(progress)

    hints = get_type_hints(inquiry)
    empty = inspect.Parameter.empty
    parameters = [
        inspect.Parameter(
            own.name,
            inspect.Parameter.POSITIONAL_OR_KEYWORD if at < inquiry.by_position else inspect.Parameter.KEYWORD_ONLY,
            default=empty if own.default is MISSING else own.default,
            annotation=hints[own.name],
        )
        for at, own in enumerate(fields(inquiry))
    ]
    ask.__name__ = ask.__qualname__ = inquiry.word
    ask.__doc__ = inquiry.__doc__
    ask.__signature__ = inspect.Signature(parameters, return_annotation=Answer)  # type: ignore[attr-defined]
    return ask
