"""Style and scripts of a page, which stands alone: nothing is fetched when it is read."""

from __future__ import annotations

import json
from importlib.resources import files
from typing import Any

from markupsafe import Markup


def asset(name: str) -> str:
    """Return the text of a file of the page, such as ``page.css``."""
    return (files(__name__) / name).read_text(encoding="utf-8")


def style(*, moving: bool) -> Markup:
    """Return the style sheet, for screen and print, with that of moving pictures where there are any."""
    return Markup(asset("page.css") + (asset("mechanism.css") if moving else ""))


def scripts(*, moving: bool) -> tuple[Markup, ...]:
    """Return the modules that draw the figures of a report, as they stand inside the page."""
    charts = Markup(asset("chart.js") + asset("report.js"))
    return (charts, Markup(asset("mechanism.js") + asset("moving.js"))) if moving else (charts,)


def as_json(content: Any) -> Markup:
    """Return a record as JSON that may stand in a script element: no text in it can end the element."""
    text = json.dumps(content, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return Markup(text.replace("<", "\\u003c"))
