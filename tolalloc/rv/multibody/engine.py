"""The only door to the multibody engine, an optional extra."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from tolalloc.exceptions import InputError


def engine() -> Any:
    """Return the module of the multibody engine.

    Raises
    ------
    InputError
        It is not installed.
    """
    try:
        return import_module("exudyn")
    except ImportError as missing:
        raise InputError(
            "virtual prototype: the multibody engine needs the optional extra: pip install tolalloc[multibody]."
        ) from missing
