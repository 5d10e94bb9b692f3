"""Pages of the documentation: pictures that blocks make, and pages made of the code itself.

Formulas are MathML, which browsers draw themselves: no script, no fonts, no network.
"""

import re
import sys
from functools import partial
from html import escape
from pathlib import Path
from typing import Any

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.addnodes import pending_xref
from sphinx.util import logging
from sphinx.util.math import get_node_equation_number

from docs.machine.generated import make_all
from docs.machine.lists import Place
from docs.machine.lists import place as documented
from docs.machine.made import MADE, make_page_pictures, place
from docs.machine.names import known, linked
from docs.machine.pages import DOCS, PICTURE
from docs.machine.rst import to_rst

log = logging.getLogger(__name__)
SIZED = re.compile(r"\\[bB]igg?[lrm]?(?![A-Za-z])")
"""Sizes of brackets, which a browser chooses itself."""
ACCENTED = re.compile(r"(\\(?:d?dot|hat|bar|tilde|vec)\s*(?:\{[^{}]*\}|[A-Za-z]))_")


BAR = '<mo stretchy="false">|</mo>'
"""The bar of an absolute value, which browsers take for a sign between two things, with blanks."""
BARS = re.compile(r"\\[lr]vert(?![A-Za-z])\s?")


def mathml(node: nodes.Element, as_block: bool) -> str:
    """A formula as MathML; a subscript follows its letter, also below a dot."""
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


LINK = re.compile(r"(\]\()([\w./-]+\.md)([#)])")
log = logging.getLogger(__name__)


def make(app: Any) -> None:
    """Before any page is read: make what they show."""
    del app
    for sentence in [*make_page_pictures(say), *make_all(say)]:
        log.warning(sentence)


def say(sentence: str) -> None:
    """A line on the error stream at once: Sphinx is set to be quiet, the long work is not."""
    print(f"docs: {sentence}", file=sys.stderr, flush=True)


def show_made(app: Any, name: str, content: list[str]) -> None:
    """Point a picture that does not lie next to its page to the one that its blocks made."""
    page = Path(app.env.doc2path(name))
    if page.suffix != ".md":
        return
    made = "/" + place(page).relative_to(DOCS).as_posix() + "/"

    def shown(match: Any) -> str:
        beside = (page.parent / match[2]).exists()
        return match[0] if beside else f"{match[1]}{made}{match[2]}{match[3]}"

    content[0] = LINK.sub(partial(to_made, page.parent), PICTURE.sub(shown, content[0]))


def to_made(folder: Path, match: re.Match[str]) -> str:
    """A link of Markdown to a page that is made of the code, which is reStructuredText."""
    there = (folder / match[2]).exists() or not (folder / f"{match[2][:-3]}.rst").exists()
    return match[0] if there else f"{match[1]}{match[2][:-3]}.rst{match[3]}"


def as_rst(app: Any, what: str, name: str, item: Any, options: Any, lines: list[str]) -> None:
    """Docstrings are plain text; what they show as code stays so."""
    del app, what, name, item, options
    lines[:] = to_rst("\n".join(lines), linked, formulas=False).splitlines()


ARRAY = re.compile(
    r"(?:~?numpy\.)?ndarray\[(?:~?builtins\.)?tuple\[(?:~?typing\.)?Any, \.\.\.\], "
    r"(?:~?numpy\.)?dtype\[(?:~?numpy\.)?(\w+)\]\]"
)
"""What Python makes of `NDArray[np.float64]`."""


def short(
    app: Any, what: str, name: str, item: Any, options: Any, given: str | None, back: str | None
) -> tuple[str | None, str | None]:
    """A signature with types of arrays as they are written."""
    del app, what, name, item, options
    return tuple(text and ARRAY.sub(r"NDArray[\1]", text) for text in (given, back))  # pyright: ignore


def find_type(app: Any, env: Any, node: Any, content: Any) -> Any:
    """A type in a signature: linked where it is public, unchanged where it is not."""
    if node.get("refdomain") != "py" or node.get("reftype") not in ("class", "exc", "data"):
        return None
    target = str(node.get("reftarget", ""))
    public = known().get(target.rpartition(".")[2])
    if public is not None and public.full != target and not target.startswith(public.full):
        domain, at = env.get_domain("py"), node.get("refdoc")
        found = domain.resolve_xref(env, at, app.builder, "obj", public.full, node, content)
        return found if found is not None else content
    return content


def forget(app: Any, error: Exception | None) -> None:
    """Take away pages of an earlier build that are none any more."""
    kept = {*app.env.found_docs, "genindex", "search", "py-modindex"}
    for path in Path(app.outdir).rglob("*.html"):
        name = path.relative_to(app.outdir).with_suffix("").as_posix()
        if error is None and name not in kept and not name.startswith("_"):
            path.unlink()


def setup(app: Any) -> dict[str, bool]:
    """Connect the above."""
    MADE.mkdir(exist_ok=True)
    app.add_html_math_renderer("mathml", (visit_inline, None), (visit_block, None))
    app.config.html_math_renderer = "mathml"
    app.connect("builder-inited", make)
    app.connect("source-read", show_made)
    app.connect("doctree-read", link)
    app.connect("autodoc-process-docstring", as_rst)
    app.connect("autodoc-process-signature", short)
    app.connect("missing-reference", find_type)
    app.connect("build-finished", forget)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def link(app: Any, tree: nodes.document) -> None:
    """Make links of the names in a hand-written page."""
    name = app.env.docname
    if not str(app.env.doc2path(name)).endswith(".md") or name == "changelog":
        return
    seen: set[tuple[int, Place]] = set()
    for literal in [*tree.findall(nodes.literal)]:
        found = documented(literal.astext())
        above = [*ancestors(literal)]
        closed = (nodes.reference, nodes.title, pending_xref, nodes.term)
        if found is None or any(isinstance(node, closed) for node in above):
            continue
        section = next((id(node) for node in above if isinstance(node, nodes.section)), 0)
        if (section, found) in seen:
            continue
        seen.add((section, found))
        domain, kind, target = found
        at = pending_xref(
            "", refdomain=domain, reftype=kind, reftarget=target, refexplicit=True, refwarn=True,
            refdoc=name,
        )  # fmt: skip
        literal.replace_self(at)
        at += literal


def ancestors(node: nodes.Node) -> list[nodes.Node]:
    """The nodes around a node, the nearest first."""
    found: list[nodes.Node] = []
    while node.parent is not None:
        node = node.parent
        found.append(node)
    return found
