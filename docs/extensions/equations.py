"""Equations as drawings in the page, made while the site is built: no network and no script to read them."""

from html import escape

import ziafont
import ziamath
from docutils.nodes import SkipNode
from sphinx.application import Sphinx

# Paths instead of symbols: symbols of one name in two drawings of a page would be taken for each other.
ziafont.config.svg2 = False
ziafont.config.precision = 2
INLINE, DISPLAYED = 17.0, 18.5  # px


def drawing(tex: str, size: float, *, inline: bool) -> str:
    """An equation as SVG, with its source for readers that cannot see it."""
    equation = ziamath.Latex(tex, size=size, color="currentColor", inline=inline)
    # What lies below the line of text goes below it here, too.
    attributes = f'role="img" aria-label="{escape(tex)}" style="vertical-align: {equation.getyofst():.1f}px"'
    return str(equation.svg()).replace("<svg ", f"<svg {attributes} ", 1)


def inline(translator, node):
    """An equation within a line."""
    translator.body.append(drawing(node.astext(), INLINE, inline=True))
    raise SkipNode


def displayed(translator, node):
    """An equation of its own, with its number where it has one."""
    number = f'<span class="number">({node["number"]})</span>' if node["number"] else ""
    name = f' id="equation-{node["label"]}"' if node["label"] else ""
    svg = drawing(node.astext(), DISPLAYED, inline=False)
    translator.body.append(f'<div class="equation"{name}><div>{svg}</div>{number}</div>')
    raise SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Sphinx calls this."""
    app.add_html_math_renderer("drawn", (inline, None), (displayed, None))
    app.config.html_math_renderer = "drawn"
    return {"parallel_read_safe": True, "parallel_write_safe": True}
