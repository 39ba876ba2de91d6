"""Reading the user's files: every way in which that can go wrong ends in one sentence."""

from __future__ import annotations

import json
import os
import re
import sys
import sysconfig
import tomllib
from collections.abc import Mapping
from dataclasses import is_dataclass
from functools import cache
from pathlib import Path
from types import FrameType
from typing import Any, TypeVar, get_args, get_type_hints

import pydantic

from tolalloc.exceptions import Faults, InputError, TolallocError, UnknownNameError, quoted
from tolalloc.reading.file_content import is_file, read_text
from tolalloc.reading.plugins import plugins, say_left_out

Model = TypeVar("Model", bound=pydantic.BaseModel)

_DEEP = re.compile(r"(?<![\w\"'-])(?:[\w\"'-]++\s*+\.\s*+){32}")
"""A name of more parts than any has; reading it takes time and memory by the square of their number."""

_FORMULA = re.compile(r"\s*[=+\-@]")
"""How a text begins that a spreadsheet calculates."""
_SIGNED = re.compile(r"[+-][0-9.]+(e[+-]?[0-9]+)?", re.IGNORECASE)

_NUMBER = "constrained-float"
"""How pydantic calls the kind of a field that may be a number in a range or a record."""
_UNKNOWN = ("extra_forbidden", "unexpected_keyword_argument")
"""How it calls a field that a record or a dataclass does not have."""


class Record(pydantic.BaseModel):
    """Base of everything that is read from a file: no unknown fields, no silent conversion, finite numbers."""

    model_config = pydantic.ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


def times(unit: float) -> pydantic.AfterValidator:
    """Return what takes a number from a file's unit, such as that of an alias `length_mm`, to SI units."""
    return pydantic.AfterValidator(lambda value: value * unit)


def found_from_here(path: str | Path) -> Path:
    """Return the user's path, as the file means it that asks for it.

    That is beside this file or one that imports it, from wherever they are imported or run; else in the current folder,
    but not while this package reads a script.
    """
    own, beside = Path(path), None
    frame: FrameType | None = sys._getframe()
    while frame:
        file = frame.f_globals.get("__file__")
        if file and is_users_file(file):
            beside = Path(file).resolve().parent / own
            if os.path.exists(beside):  # a name too long is no file
                return beside
        elif beside and frame.f_globals.get("__name__", "").startswith("tolalloc."):
            return beside
        frame = frame.f_back
    return own


@cache
def is_users_file(path: str) -> bool:
    """Return whether a file is neither of Python, nor of this package, nor of an installed library."""
    found, package = Path(path).resolve(), Path(__file__).resolve().parents[1]
    folders = (package, *(Path(sysconfig.get_path(kind)).resolve() for kind in ("stdlib", "platstdlib")))
    return not {"site-packages", "dist-packages"} & {*found.parts} and not any(map(found.is_relative_to, folders))


def read_toml(path: Path) -> dict[str, Any]:
    """Return the content of a TOML file.

    Raises
    ------
    InputError
        The file is missing, not text, not complete TOML, or nested more deeply than any of ours.
    """
    text = read_text(path, "a text file in TOML")
    try:
        if not _DEEP.search(text):
            return tomllib.loads(text)
    except RecursionError:
        pass
    except ValueError as error:  # of tomllib, or of a whole number with more digits than Python reads
        raise InputError(f"{path}: not complete TOML; is the file truncated? ({error}).") from None
    raise InputError(f"{path}: its tables or lists are nested too deeply; allowed are a few levels.")


def validated(model: type[Model], data: Mapping[str, Any], place: Path | str) -> Model:
    """Return the record, or everything that is wrong with it, a sentence each.

    Raises
    ------
    InputError, UnknownNameError
        A field is missing, its value is not allowed, or the record does not have it.
    """
    try:
        return model.model_validate(data)
    except pydantic.ValidationError as error:
        # The check of a whole record can say more than the check of one field, so unknown fields come first.
        # A field that is a number or a record fails as both; who wrote a record did not mean the number.
        problems = sorted(
            error.errors(),
            key=lambda problem: (
                problem["type"] not in _UNKNOWN,
                problem["loc"][-1:] == (_NUMBER,) and isinstance(problem["input"], Mapping),
            ),
        )
    found: dict[tuple[int | str, ...], TolallocError] = {}
    for problem in problems:
        place_in_file = _place_in_file(problem["loc"], data, problem["type"] == "missing")
        found.setdefault(tuple(place_in_file), _said(model, problem, place_in_file, place))
    faults, offered = Faults(), set[str]()
    for at, said in found.items():
        if isinstance(said, UnknownNameError):
            offered |= {word.strip(",.") for word in str(said).split()}
        elif str(said).endswith(" is missing.") and ".".join(map(str, at)) in offered:
            continue  # misspelt, which is said
        if not any(other[: len(at)] == at for other in found if len(other) > len(at)):  # what is inside says more
            with faults.kept():
                raise said
    faults.require_none()
    raise AssertionError("a record that is refused has a fault")


def _said(model: type[Model], problem: Any, place_in_file: list[int | str], place: Path | str) -> TolallocError:
    """Return what is wrong in one place of a record."""
    field = ".".join(str(part) for part in place_in_file)
    if problem["type"] in _UNKNOWN:
        return UnknownNameError.among(place, "field", field, _known_fields(model, place_in_file))
    if problem["type"] == "missing":
        return InputError(f"{place}: {field} is missing.")
    message = problem["msg"].removeprefix("Value error, ")
    if message[1:2].islower():
        message = message[0].lower() + message[1:]
    if isinstance(problem["input"], Mapping):  # a check of several fields together names their values itself
        whole = f"{field}: " if field else ""
        return InputError(f"{place}: {whole}{message}.")
    return InputError(f"{place}: {field} is {quoted(problem['input'])}; {message}.")


def _place_in_file(location: tuple[int | str, ...], data: Any, missing: bool) -> list[int | str]:
    """Return where in the data a problem is; of a field that may be of several kinds, pydantic names the kind too."""
    found: list[int | str] = []
    for part in location:
        known = part in data if isinstance(data, Mapping) else isinstance(data, list) and part in range(len(data))
        if known:
            data = data[part]
        elif not (missing and part == location[-1]):
            continue
        found.append(part)
    return found


def _fields(kind: Any) -> dict[str, Any]:
    """Return the fields of a record, or of a dataclass that is read from a file, as files name them: their types."""
    if isinstance(kind, type) and issubclass(kind, pydantic.BaseModel):
        return {name: info.annotation for name, info in kind.model_fields.items()}
    if not (isinstance(kind, type) and is_dataclass(kind)):
        return {}
    fields = {}
    for name, hint in get_type_hints(kind, include_extras=True).items():
        aliases = [getattr(mark, "alias", None) for mark in getattr(hint, "__metadata__", ())]
        fields[next(filter(None, aliases), name)] = hint
    return fields


def _known_fields(kind: Any, location: list[int | str]) -> list[str]:
    """Return the dotted names of the fields beside an unknown one."""
    prefix, kinds = "", [kind]
    for part in location[:-1]:
        inner = [own for one in kinds for own in _records(_fields(one).get(str(part)))]
        if not inner:
            break
        kinds, prefix = inner, f"{prefix}{part}."
    return [prefix + name for one in kinds for name in _fields(one)]


def _records(hint: Any) -> list[Any]:
    """Return what a field's type may be that has fields of its own."""
    return [hint] if _fields(hint) else [own for part in get_args(hint) for own in _records(part)]


def shipped_files(folder: Path, suffix: str) -> dict[str, Path]:
    """Return the files of a kind by name: the shipped ones of a folder, then those that other packages bring."""
    found = {file.name.removesuffix(suffix): file for file in folder.glob(f"*{suffix}")}
    for module in plugins("files", (), ("__path__",)).values():
        for file in sorted(file for place in module.__path__ for file in Path(place).glob(f"*{suffix}")):
            if found.setdefault(file.name.removesuffix(suffix), file) != file:
                say_left_out(str(file), "a file of that name is known already")
    return found


def shipped_or_path(name: str | Path, folder: Path, suffix: str, what: str) -> Path:
    """Return the file for a shipped name, or the user's own path.

    Raises
    ------
    UnknownNameError
        Neither a shipped name nor an existing file.
    """
    if not isinstance(name, str | Path):
        raise InputError.at(f"{what} file", "name", name, "a shipped name or a path")
    shipped = shipped_files(folder, suffix)
    if str(name) in shipped:
        return shipped[str(name)]
    path = found_from_here(name)
    if is_file(path):
        return path
    if path.suffix and os.path.exists(path):
        raise InputError(f"{path}: is a folder, a device or a pipe; allowed is a file.")
    if path.suffix:
        raise InputError(f"{path}: no such file; shipped {what} files are {', '.join(sorted(shipped))}.")
    raise UnknownNameError.among(f"shipped {what} files", "name", str(name), shipped)


def require_new(path: Path) -> None:
    """Raise if a file is there already or its folder cannot be written, before anything long runs."""
    if path.exists():
        raise InputError(f"{path}: the file exists; name a new one, nothing is overwritten.")
    if not path.parent.is_dir() or not os.access(path.parent, os.W_OK):
        raise InputError(f"{path}: cannot be made there; allowed is a file in a folder that exists and may be written.")


def write_new(path: Path, text: str) -> None:
    """Write a new text file; one that is there already or cannot be made is an InputError."""
    require_new(path)
    try:
        with path.open("x", encoding="utf-8", newline="") as file:
            file.write(text)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror}); name another file.") from None


def no_formula(cell: object) -> object:
    """Return a cell as a CSV file holds it: text that a spreadsheet would calculate stands behind an apostrophe."""
    return f"'{cell}" if isinstance(cell, str) and is_formula(cell) else cell


def is_formula(text: str) -> bool:
    """Return whether a spreadsheet would calculate a text; a number is none."""
    return bool(_FORMULA.match(text)) and not _SIGNED.fullmatch(text)


def as_toml(value: str | float | tuple[str, ...]) -> str:
    """Return text, a number or texts as TOML writes them."""
    if isinstance(value, tuple):
        return "[" + ", ".join(map(as_toml, value)) + "]"
    if isinstance(value, str):
        # JSON's escapes are TOML's, but for one character that JSON leaves as it is.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    return repr(float(value))
