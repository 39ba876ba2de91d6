"""How an option is said: errors by the option's name, and a value that is no number in a sentence of ours."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import wraps
from typing import Any, get_type_hints

import typer
from typer.core import TyperGroup
from typer.models import OptionInfo

from tolalloc.exceptions import InputError


def saying_options(command: Callable[..., None], word: str) -> Callable[..., None]:
    """Return a command whose errors say its options where the package says the name of an argument."""

    @wraps(command)
    def run(**given: object) -> None:
        try:
            command(**given)
        except InputError as error:
            option = _option(command, error.argument)
            raise (error.as_option(f"tolalloc {word}", option) if option else error) from None

    return run


def _option(command: Callable[..., None], argument: str) -> str:
    """Return the option from which an argument comes, which may carry its unit besides; nothing if there is none."""
    for name, kind in get_type_hints(command, include_extras=True).items():
        if argument == name or argument.startswith(f"{name}_"):
            for own in getattr(kind, "__metadata__", ()):
                if isinstance(own, OptionInfo):
                    # typer takes the first name of an option in an annotation for its default.
                    stated = [each for each in (own.default, *(own.param_decls or ())) if str(each).startswith("--")]
                    return str([*stated, f"--{name.replace('_', '-')}"][0])
    return ""


class SayingNumbers(TyperGroup):
    """All commands; an option or argument that is no number is refused in a sentence of ours."""

    def invoke(self, ctx: Any) -> Any:
        """Run the command that was asked for.

        Raises
        ------
        InputError
            The option, its value, and that a number is allowed.
        """
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
