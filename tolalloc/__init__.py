"""Which drawing tolerance drives an output, and which tolerances and settings meet a limit at the lowest cost.

A study asks questions of a model at the zones of a drawing:

>>> import tolalloc as ta
>>> study = ta.Study(
...     ta.reducer("rv20e", flank_clearance=(1.0, 8.0), radial_clearance=(3.0, 30.0)),
...     ta.drawing("rv20e_drawing"),
...     limits={ta.PEAK_TO_PEAK: ta.Limit(upper=60.0, show=ta.AtYield(target=0.9973))},
...     questions=[ta.Ranking(), ta.Allocation()],
... )

``study.run("runs/mine", effort="quick")`` writes the report, ``study.rank()`` and ``study.allocate()`` return answers.
To begin with:

=============================== ====================================================================
`Study`                         what is asked, of which model, at which drawing, with which limits
`reducer`, `model`              the model: a reducer, or any function of your own
`drawing`                       the tolerance table, CSV or Excel
`Limit`, `AtYield`              a limit, and the share of units that must keep it
`Ranking`, `Allocation`         which tolerance drives the output; which drawing is cheapest
`Sorting`, `Shim`, `LoadCase`   parts chosen at assembly; cold, warm, worn, under another load
`new`                           a folder that runs at once, as the start of your own
=============================== ====================================================================

Names are loaded when they are first used, so that importing the package takes a fraction of a second.
"""

from __future__ import annotations

import ast
from importlib import import_module
from pathlib import Path
from typing import Any

_STUB = ast.parse(Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8"))
_WHERE = {
    name.asname: (str(node.module), name.name)
    for node in _STUB.body
    if isinstance(node, ast.ImportFrom)
    for name in node.names
    if name.asname
}
"""Public name → the module where it stands, and its name there."""


def _words() -> dict[str, Any]:
    """Return the questions that need no study, by the word of their command and function."""
    from tolalloc.wings import all_inquiries

    return {own.word: own for own in all_inquiries()}


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("tolalloc")
    if name == "__all__":
        return sorted([*_WHERE, *_words()])
    if name in _WHERE:
        module, own = _WHERE[name]
        return import_module(f"{module}.{own}") if module == __name__ else getattr(import_module(module), own)
    if not name.startswith("_") and (inquiry := _words().get(name)):
        from tolalloc.study.inquiry import door

        return door(inquiry)
    raise AttributeError(f"module 'tolalloc' has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*__getattr__("__all__"), "__version__"]
