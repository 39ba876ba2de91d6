"""Style and scripts of a page, which stands alone: nothing is fetched when it is read."""

from __future__ import annotations

import json
from importlib.resources import files
from typing import Any

from markupsafe import Markup


def asset(name: str) -> str:
    """Return the text of a file of the page, such as ``page.css``."""
    return (files(__name__) / name).read_text(encoding="utf-8")


def style() -> Markup:
    """Return the style sheet, for screen and print."""
    return Markup(asset("page.css"))


def script() -> Markup:
    """Return the module that draws the figures of a report, as it stands inside the page."""
    return Markup(asset("chart.js") + asset("report.js"))


def as_json(content: Any) -> Markup:
    """Return a record as JSON that may stand in a script element: no text in it can end the element."""
    text = json.dumps(content, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return Markup(text.replace("<", "\\u003c"))
