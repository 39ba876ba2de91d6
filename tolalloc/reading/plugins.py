"""What other installed packages bring, by entry points: one group, ``tolalloc.NAME``, for each kind of thing.

Nothing is loaded before a list asks for it. What cannot be used is left out with one sentence that names its package.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from tolalloc.exceptions import in_short

GROUPS = ("families", "files", "outputs", "models", "questions", "exports", "wings")


@cache
def _entries(group: str) -> list[tuple[str, str, EntryPoint]]:
    """Return package, version and entry point of all that is installed of a group, in the order of their names."""
    brought = (own for own in entry_points(group=f"tolalloc.{group}") if own.dist and own.dist.name)
    found = ((own.dist.name, own.dist.version, own) for own in brought if own.dist)
    return sorted(found, key=lambda own: (own[0], own[2].name))


def plugin_versions() -> dict[str, str]:
    """Return the version of every package that brings something."""
    return {package: version for group in GROUPS for package, version, _ in _entries(group)}


@cache
def say_left_out(what: str, why: str) -> None:
    """Say once that something of another package is not used, on standard error unless logging goes elsewhere."""
    logging.getLogger("tolalloc").warning("%s is left out: %s.", what, in_short(why.strip().rstrip(".")))


@contextmanager
def left_out_if_broken(what: str) -> Iterator[None]:
    """Turn whatever code of another package raises into a sentence."""
    try:
        yield
    except (Exception, SystemExit) as error:
        say_left_out(what, f"{type(error).__name__}: {error}".partition("\n")[0])


def plugins(
    group: str,
    taken: Iterable[str],
    needs: tuple[str, ...],
    named_by: str = "",
    require: Callable[[Any], object] = lambda _: None,
    kind: type = object,
) -> dict[str, Any]:
    """Return what other packages bring of a group, by name.

    Parameters
    ----------
    group
        One of `GROUPS`.
    taken
        Names that are shipped; what has one of them is left out.
    needs
        Attributes by which such a thing is known.
    named_by
        Attribute that holds its name, or its names; that of the entry point unless given.
    require
        Raises what is wrong with a thing that has all these.
    kind
        What it is an instance of, or a subclass where it is a class itself.
    """
    found, known = dict[str, Any](), {*taken}
    for package, version, entry in _entries(group):
        with left_out_if_broken(f"{package} {version}: {entry.name!r} of tolalloc.{group}"):
            thing = entry.load()
            if wanting := [name for name in needs if not hasattr(thing, name)]:
                raise TypeError(f"{entry.value} has no {', '.join(wanting)}")
            if not (issubclass(thing, kind) if isinstance(thing, type) else isinstance(thing, kind)):
                raise TypeError(f"{entry.value} is no {kind.__name__}")
            names = getattr(thing, named_by) if named_by else entry.name
            names = (names,) if isinstance(names, str) else tuple(names)
            if double := known.intersection(names):
                raise ValueError(f"{', '.join(sorted(double))} is known already, give it another name")
            require(thing)
            known.update(names)
            found[", ".join(names)] = thing
    return found
