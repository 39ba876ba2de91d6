"""Links that no hand writes: from the name of something public, wherever it stands as code, to its full description."""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes
from sphinx import addnodes
from sphinx.transforms import SphinxTransform

import tolalloc as ta

SHORT_LIST = "reference/api"
"""The page on which the bare names stand."""
PERCENT = re.compile(r"(?<=\d) %")


class PublicNames(SphinxTransform):
    """Make each public name a link, ``ta.Study`` on any page and ``Study`` on the short list."""

    default_priority = 400

    def apply(self, **_: Any) -> None:
        """Link the names of a page."""
        for node in list(self.document.findall(nodes.literal)):
            name = node.astext()
            short = name if self.env.docname == SHORT_LIST else name.removeprefix("ta.") if name[:3] == "ta." else ""
            if short not in ta.__all__ or isinstance(node.parent, nodes.reference | addnodes.pending_xref):
                continue
            link = addnodes.pending_xref(
                "", refdomain="py", reftype="obj", reftarget=f"tolalloc.{short}", refwarn=True, refdoc=self.env.docname
            )
            link["refexplicit"] = True
            node.replace_self(link)
            link += node


class PercentSigns(SphinxTransform):
    """Keep a percent sign on the line of its number."""

    default_priority = 401

    def apply(self, **_: Any) -> None:
        """Put a narrow space that does not break before each."""
        for node in list(self.document.findall(nodes.Text)):
            if not isinstance(
                node.parent, nodes.literal | nodes.literal_block | nodes.math | nodes.math_block | nodes.raw
            ):
                text = PERCENT.sub("\u202f%", node.astext())
                if text != node.astext():
                    node.parent.replace(node, nodes.Text(text))


def setup(app: Any) -> dict[str, bool]:
    """Add both to Sphinx."""
    app.add_transform(PublicNames)
    app.add_transform(PercentSigns)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
