"""Formulas as MathML, which browsers draw themselves: no script, no fonts, no network."""

import re
from html import escape
from typing import Any

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.util import logging
from sphinx.util.math import get_node_equation_number

log = logging.getLogger(__name__)
SIZED = re.compile(r"\\[bB]igg?[lrm]?(?![A-Za-z])")
"""Sizes of brackets, which a browser chooses itself."""
ACCENTED = re.compile(r"(\\(?:d?dot|hat|bar|tilde|vec)\s*(?:\{[^{}]*\}|[A-Za-z]))_")


BAR = '<mo stretchy="false">|</mo>'
"""The bar of an absolute value, which browsers take for a sign between two things, with blanks."""
BARS = re.compile(r"\\[lr]vert(?![A-Za-z])\s?")


def mathml(node: nodes.Element, as_block: bool) -> str:
    """A formula as MathML; a subscript stands beside its letter, also below a dot."""
    formula = SIZED.sub("", ACCENTED.sub(r"\1{}_", node.astext())).replace(r"\dots", r"\ldots")
    try:
        found = str(tex2mathml(BARS.sub("|", formula), as_block=as_block))
        return found.replace(BAR, BAR.replace(">", ' lspace="0" rspace="0">', 1))
    except MathError as error:
        log.warning("formula %r: %s", node.astext(), error, location=node)
        return f"<code>{escape(node.astext())}</code>"


def visit_inline(writer: Any, node: nodes.math) -> None:
    """A formula within a line."""
    writer.body.append(mathml(node, as_block=False))
    raise nodes.SkipNode


def visit_block(writer: Any, node: nodes.math_block) -> None:
    """A formula on its own, with its number where it has a label."""
    writer.body.append(writer.starttag(node, "div", CLASS="math"))
    if node["number"]:
        number = get_node_equation_number(writer, node)
        writer.body.append(f'<span class="eqno">({number})</span>')
    writer.body.append(mathml(node, as_block=True))
    writer.body.append("</div>\n")
    raise nodes.SkipNode


def setup(app: Any) -> dict[str, bool]:
    """Make it the renderer of formulas."""
    app.add_html_math_renderer("mathml", (visit_inline, None), (visit_block, None))
    app.config.html_math_renderer = "mathml"
    return {"parallel_read_safe": True, "parallel_write_safe": True}
