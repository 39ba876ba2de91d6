"""How the record of an inquiry becomes a command, and how a refusal of any command names its option."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterable
from functools import wraps
from typing import Annotated, Any, get_args, get_type_hints

import typer
from typer.core import TyperGroup
from typer.models import OptionInfo

from tolalloc.cli.console import AsJson, ReportFolder, announce_compilation, note, shown_progress, tell, write_report
from tolalloc.exceptions import InputError
from tolalloc.study.inquiry import Inquiry, Word


def inquiry_command(inquiry: type[Inquiry[Any]]) -> Callable[..., None]:
    """Return the command of an inquiry."""

    def command(out: ReportFolder = None, as_json: AsJson = False, **given: Any) -> None:
        from tolalloc.reports.folder import require_usable

        asked = inquiry(**given).with_reducer(out, argument="--reducer")
        asked.apart_from(out)
        require_usable(out)
        prepared = asked.prepare()
        if asked.room(prepared):
            announce_compilation()
        with shown_progress(inquiry.counted) as progress:
            progress.begin(inquiry.word)
            answer = asked.solve(prepared, progress)
            write_report(answer, out, progress)
        for sentence in asked.write(answer):
            note(sentence)
        tell(answer, as_json, *answer.teller.terminal)

    command.__name__ = inquiry.word
    command.__doc__ = inspect.cleandoc(inquiry.__doc__ or "").split("\n\n")[0]
    own = [_parameter(inquiry, at, field) for at, field in enumerate(parameters_of(inquiry))]
    return taking(command, (*own, *parameters_of(command)))


def parameters_of(stated: Callable[..., Any]) -> list[inspect.Parameter]:
    """Return the fields of a record, or what a function names, each to be given by its name."""
    found = inspect.signature(stated, eval_str=True).parameters.values()
    return [own.replace(kind=own.KEYWORD_ONLY) for own in found if own.kind is not own.VAR_KEYWORD]


def taking(command: Callable[..., None], parameters: Iterable[inspect.Parameter]) -> Callable[..., None]:
    """Return a command that says it takes just these, in this order."""
    command.__signature__ = inspect.Signature([*parameters])  # type: ignore[attr-defined]
    command.__annotations__ = {own.name: own.annotation for own in parameters}
    return command


def _parameter(inquiry: type[Inquiry[Any]], at: int, own: inspect.Parameter) -> inspect.Parameter:
    """Return the argument or option of a field."""
    kind, word = get_args(own.annotation)[:2]
    if not isinstance(word, Word):
        raise TypeError(f"{inquiry.__name__}.{own.name}: its annotation has no Word")
    names = (word.option,) if word.option else ()
    said = typer.Argument(help=word.help) if at < inquiry.by_position else typer.Option(*names, help=word.help)
    return own.replace(annotation=Annotated[kind, said])


def saying_options(command: Callable[..., None], word: str) -> Callable[..., None]:
    """Return a command whose errors say its options where the package says the name of an argument."""

    @wraps(command)
    def run(**given: object) -> None:
        try:
            command(**given)
        except InputError as error:
            option = _option(command, error)
            raise (error.as_option(f"tolalloc {word}", option) if option else error) from None

    return run


def _option(command: Callable[..., None], error: InputError) -> str:
    """Return the option whose value an error refuses; nothing if there is none."""
    kinds = get_type_hints(command, include_extras=True)
    name = error.named_among(kinds)
    for own in getattr(kinds.get(name), "__metadata__", ()):
        if isinstance(own, OptionInfo):
            # typer takes the first name of an option in an annotation for its default.
            stated = [each for each in (own.default, *(own.param_decls or ())) if str(each).startswith("--")]
            return str([*stated, f"--{name.replace('_', '-')}"][0])
    return ""


class SayingNumbers(TyperGroup):
    """All commands; an option or argument that is no number is refused in a sentence of ours."""

    def invoke(self, ctx: Any) -> Any:
        """Run the command that was asked for."""
        try:
            return super().invoke(ctx)
        except typer.BadParameter as error:
            raise _no_number(error) or error from None


def _no_number(error: typer.BadParameter) -> InputError | None:
    """Return the refusal of a value that is no number; nothing if something else was wrong."""
    numbers = {"integer": "a whole number", "number": "a number", "float": "a number"}
    allowed = next((own for word, own in numbers.items() if f"valid {word}" in error.message), "")
    if not allowed or error.param is None or error.ctx is None:
        return None
    names = [name for name in error.param.opts if name.startswith("-")] or [f"argument {error.param.name}"]
    return InputError.at(f"tolalloc {error.ctx.info_name}", names[0], _given(error), allowed)


def _given(error: typer.BadParameter) -> str:
    """Return the text that was given: typer keeps it in the cause, and says it where it has none."""
    found = getattr(error.__cause__, "errors", None)
    if found:
        return str(found()[0]["input"])
    said = re.match(r"'(.*)' is not", error.message)
    return said[1] if said else error.message
