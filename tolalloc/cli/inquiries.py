"""Commands that are made from the record of an inquiry: its fields are the options, its docstring the help."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Annotated, Any, get_args, get_type_hints

import typer

from tolalloc.cli.console import AsJson, ReportFolder, announce_compilation, note, shown_progress, tell, write_report
from tolalloc.study.inquiry import Inquiry, Word


def inquiry_command(inquiry: type[Inquiry[Any]]) -> Callable[..., None]:
    """Return the command of an inquiry."""

    def command(out: Path | None, as_json: bool, **given: Any) -> None:
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
    own = [_parameter(inquiry, at) for at in range(len(fields(inquiry)))]
    last = [_keyword("out", ReportFolder, None), _keyword("as_json", AsJson, False)]
    command.__signature__ = inspect.Signature([*own, *last])  # type: ignore[attr-defined]
    command.__annotations__ = {one.name: one.annotation for one in (*own, *last)}
    return command


def _parameter(inquiry: type[Inquiry[Any]], at: int) -> inspect.Parameter:
    """Return the argument or option of a field."""
    own = fields(inquiry)[at]
    kind, word = get_args(get_type_hints(inquiry, include_extras=True)[own.name])[:2]
    if not isinstance(word, Word):
        raise TypeError(f"{inquiry.__name__}.{own.name}: its annotation has no Word")
    names = (word.option,) if word.option else ()
    said = typer.Argument(help=word.help) if at < inquiry.by_position else typer.Option(*names, help=word.help)
    return _keyword(own.name, Annotated[kind, said], ... if own.default is MISSING else own.default)


def _keyword(name: str, annotation: Any, default: Any) -> inspect.Parameter:
    empty = inspect.Parameter.empty
    given = empty if default is ... else default
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=given, annotation=annotation)
