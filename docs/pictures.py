"""Pictures of answers on the pages that run: what ends a block with ``answer.plot()`` shows its figure."""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure
from sphinx_gallery.scrapers import figure_rst


def of_answers(_: Any, block_vars: dict[str, Any], gallery_conf: dict[str, Any]) -> str:
    """Return the page's lines for the picture that a block gave as its last value, each once."""
    names = block_vars["example_globals"]
    last = names.get("___")
    if not isinstance(last, Figure) or names.get("_shown_before") is last:
        return ""
    names["_shown_before"] = last
    path = next(block_vars["image_path_iterator"])
    last.savefig(path, dpi=110)
    return str(figure_rst([path], gallery_conf["src_dir"]))
