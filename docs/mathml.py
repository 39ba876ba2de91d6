r"""Equations of the handbook as MathML, which a browser draws by itself: no script, no network, no picture.

A displayed equation says its number by ``\tag{13}``; the page shows it at the right, and ``#equation-13`` leads there.
The font of the equations is made when the handbook is: the glyphs that equations need, of STIX Two Math.
"""

from __future__ import annotations

import logging
import re
from html import escape
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from docutils import nodes
from fontTools import subset
from latex2mathml.converter import convert
from sphinx.transforms import SphinxTransform

TAG = re.compile(r"\s*\\tag\{(\d+)\}\s*")
FUNCTION = re.compile(r"<m[io]>(sin|cos|ln|arg|exp|max|min|diag|std)</m[io]>(?P<bracket><mo[^>]*>&#x00028;)?")
BARS = re.compile(r"(?<!\\left)(?<!\\right)\|([^|]+?)(?<!\\left)(?<!\\right)\|")
SIGN = re.compile(r"((?:&#x0003D;|&#x00028;|&#x0002C;)</mo>)<mo>(&#x02212;|&#x0002B;)</mo>")
FONT = "fonts/STIXTwoMath-Regular.ttf"
"""Place of the font in the package that brings it."""
GLYPHS = (range(0x20, 0x250), range(0x2B0, 0x400), range(0x2000, 0x2300), range(0x1D400, 0x1D800))
"""Latin, Greek, signs, and the letters of mathematics."""


def mathml(latex: str, display: str) -> str:
    """Return an equation as a MathML element that says its LaTeX to who cannot see it."""
    plain = BARS.sub(r"\\left|\1\\right|", latex.strip().replace(r"\lvert", "|").replace(r"\rvert", "|"))
    made = convert(plain, display=display)
    made = re.sub(r"<mo[^>]*>&#x02015;</mo></mover>", '<mo stretchy="true">&#x0203E;</mo></mover>', made)
    made = re.sub(r"<mo[^>]*>&#x02015;</mo></munder>", '<mo stretchy="true">&#x0005F;</mo></munder>', made)
    for wrong, right in (
        ("<mi>&#x02032;</mi>", "<mo>&#x02032;</mo>"),
        ("<mi>&#x000B1;</mi>", "<mo>&#x000B1;</mo>"),
        ("<mi>&#x0007E;</mi>", "<mo>&#x0223C;</mo>"),
        ("<mo>&#x0002F;</mo>", '<mo lspace="0" rspace="0">&#x0002F;</mo>'),
    ):
        made = made.replace(wrong, right)
    made = SIGN.sub(r'\1<mo form="prefix">\2</mo>', made)
    made = FUNCTION.sub(_spaced, made)
    return made.replace("<math ", f'<math alttext="{escape(" ".join(latex.split()))}" ', 1)


def _spaced(found: re.Match[str]) -> str:
    """Return the name of a function with a thin space on either side, none before a bracket."""
    behind = "0" if found["bracket"] else "0.17em"
    return f'<mo form="prefix" lspace="0.17em" rspace="{behind}">{found[1]}</mo>{found["bracket"] or ""}'


def write_font(target: Path) -> None:
    """Write the part of the font that equations need."""
    logging.getLogger("fontTools.subset").setLevel(logging.WARNING)
    package = find_spec("ziamath")
    assert package and package.origin
    options = subset.Options(flavor="woff", layout_features=["*"], notdef_outline=True)
    font = subset.load_font(str(Path(package.origin).parent / FONT), options)
    cut = subset.Subsetter(options)
    cut.populate(unicodes=[code for codes in GLYPHS for code in codes])
    cut.subset(font)
    target.parent.mkdir(parents=True, exist_ok=True)
    subset.save_font(font, str(target), options)


class NumberedEquations(SphinxTransform):
    """Give each displayed equation with a number a place that a link can name."""

    default_priority = 800  # before links inside a page are resolved

    def apply(self, **_: Any) -> None:
        """Name the equations of a page."""
        for node in self.document.findall(nodes.math_block):
            found = TAG.search(node.astext())
            if found:
                node["names"].append(f"equation-{found[1]}")
                self.document.note_explicit_target(node)


def inline(writer: Any, node: nodes.math) -> None:
    """Write an equation inside a sentence."""
    writer.body.append(mathml(node.astext(), "inline"))
    raise nodes.SkipNode


def block(writer: Any, node: nodes.math_block) -> None:
    """Write an equation on a line of its own, with its number."""
    latex = node.astext()
    found = TAG.search(latex)
    number = f'<span class="eqno">({found[1]})</span>' if found else ""
    ids = f' id="{node["ids"][0]}"' if node["ids"] else ""
    formula = mathml(TAG.sub("", latex), "block")
    writer.body.append(f'<div class="equation"{ids}><div class="formula">{formula}</div>{number}</div>\n')
    raise nodes.SkipNode


def _write_font(app: Any) -> None:
    if app.builder.format == "html":
        write_font(Path(app.outdir) / "_static" / "math.woff")


def setup(app: Any) -> dict[str, bool]:
    """Add the way of writing equations to Sphinx."""
    app.add_html_math_renderer("mathml", (inline, None), (block, None))
    app.add_transform(NumberedEquations)
    app.connect("builder-inited", _write_font)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
