"""Extension of Sphinx: builds what pages show, links names, draws formulas as MathML.

Browsers draw MathML without scripts, fonts or network.
"""

import re
import sys
from html import escape
from pathlib import Path
from typing import Any

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.addnodes import pending_xref
from sphinx.util import logging
from sphinx.util.math import get_node_equation_number

from docs.machine.build import MADE, make_all, place
from docs.machine.docstrings import to_rst
from docs.machine.items import LAW_PAGES, signature
from docs.machine.lists import known
from docs.machine.lists import place as documented
from docs.machine.pages import DOCS, PICTURE
from symfric.scenes import ALL_SCENES

log = logging.getLogger(__name__)
SIZED = re.compile(r"\\[bB]igg?[lrm]?(?![A-Za-z])")
"""Sizes of brackets, which a browser chooses itself."""
ACCENTED = re.compile(r"(\\(?:d?dot|hat|bar|tilde|vec)\s*(?:\{[^{}]*\}|[A-Za-z]))_")
BAR = '<mo stretchy="false">|</mo>'
"""Bar of an absolute value, which browsers take for an operator and surround with blanks."""
BARS = re.compile(r"\\[lr]vert(?![A-Za-z])\s?")


def mathml(node: nodes.Element, as_block: bool) -> str:
    """Return a formula as MathML; a subscript follows its letter, also below a dot."""
    formula = SIZED.sub("", ACCENTED.sub(r"\1{}_", node.astext())).replace(r"\dots", r"\ldots")
    try:
        found = str(tex2mathml(BARS.sub("|", formula), as_block=as_block))
        return found.replace(BAR, BAR.replace(">", ' lspace="0" rspace="0">', 1))
    except MathError as error:
        log.warning("formula %r: %s", node.astext(), error, location=node)
        return f"<code>{escape(node.astext())}</code>"


def visit_inline(writer: Any, node: nodes.math) -> None:
    """Write a formula within a line."""
    writer.body.append(mathml(node, as_block=False))
    raise nodes.SkipNode


def visit_block(writer: Any, node: nodes.math_block) -> None:
    """Write a formula of its own, with its number if it has a label."""
    writer.body.append(writer.starttag(node, "div", CLASS="math"))
    if node["number"]:
        number = get_node_equation_number(writer, node)
        writer.body.append(f'<span class="eqno">({number})</span>')
    writer.body.append(mathml(node, as_block=True))
    writer.body.append("</div>\n")
    raise nodes.SkipNode


def make(app: Any) -> None:
    """Build all contents before any page is read."""
    del app
    for failure in make_all(lambda text: print(f"docs: {text}", file=sys.stderr, flush=True)):
        log.warning(failure)


def show_made(app: Any, name: str, content: list[str]) -> None:
    """Point pictures that are not next to their page to those that its blocks made."""
    page = Path(app.env.doc2path(name))
    if page.is_relative_to(DOCS) and page.suffix == ".md":
        made = "/" + place(page).relative_to(DOCS).as_posix() + "/"

        def shown(match: Any) -> str:
            beside = (page.parent / match[2]).exists()
            return match[0] if beside else f"{match[1]}{made}{match[2]}{match[3]}"

        content[0] = PICTURE.sub(shown, content[0])


def as_rst(app: Any, what: str, name: str, item: Any, options: Any, lines: list[str]) -> None:
    """Convert a docstring, which is plain text; equations of laws and scenes become formulas."""
    del app, what, name, options
    kinds = (*LAW_PAGES.values(), *ALL_SCENES.values())
    formulas = isinstance(item, type) and any(issubclass(kind, item) for kind in kinds)
    lines[:] = to_rst("\n".join(lines), formulas).splitlines()


ARRAY = re.compile(
    r"(?:~?numpy\.)?ndarray\[(?:~?builtins\.)?tuple\[(?:~?typing\.)?Any, \.\.\.\], "
    r"(?:~?numpy\.)?dtype\[(?:~?numpy\.)?(\w+)\]\]"
)
"""Python's form of `NDArray[np.float64]`."""


def short(
    app: Any, what: str, name: str, item: Any, options: Any, given: str | None, back: str | None
) -> tuple[str | None, str | None]:
    """Shorten a signature: arrays as they are written, laws and scenes without types."""
    del app, what, name, options
    if item in (*LAW_PAGES.values(), *ALL_SCENES.values()):
        return signature(item), None
    return tuple(text and ARRAY.sub(r"NDArray[\1]", text) for text in (given, back))  # pyright: ignore


def find_type(app: Any, env: Any, node: Any, content: Any) -> Any:
    """Link a type in a signature if it is public; leave others unchanged."""
    if node.get("refdomain") != "py" or node.get("reftype") not in ("class", "exc", "data", "obj"):
        return None
    target = str(node.get("reftarget", ""))
    public = known().get(target.rpartition(".")[2])
    if public is not None and public.full != target and not target.startswith(public.full):
        domain, at = env.get_domain("py"), node.get("refdoc")
        found = domain.resolve_xref(env, at, app.builder, "obj", public.full, node, content)
        return found if found is not None else content
    return content if node["reftype"] != "obj" else None


def link(app: Any, tree: nodes.document) -> None:
    """Link names between backticks to their documentation, once in a section."""
    name, seen = app.env.docname, set[tuple[int, object]]()
    for literal in [*tree.findall(nodes.literal)] if name != "changelog" else ():
        found, above = documented(literal.astext()), [*ancestors(literal)]
        closed = (nodes.reference, nodes.title, pending_xref, nodes.term)
        section = next((id(node) for node in above if isinstance(node, nodes.section)), 0)
        if found is None or (section, found) in seen or found[2] == f"/{name}":
            continue
        if not any(isinstance(node, closed) for node in above):
            seen.add((section, found))
            domain, kind, target = found
            reference = pending_xref(
                "", refdomain=domain, reftype=kind, reftarget=target, refexplicit=True,
                refwarn=True, refdoc=name,
            )  # fmt: skip
            literal.replace_self(reference)
            reference += literal


def ancestors(node: nodes.Node) -> list[nodes.Node]:
    """Return the nodes around a node, the nearest first."""
    found: list[nodes.Node] = []
    while node.parent is not None:
        node = node.parent
        found.append(node)
    return found


def forget(app: Any, error: Exception | None) -> None:
    """Remove pages of an earlier build."""
    kept = {*app.env.found_docs, "genindex", "search", "py-modindex"}
    for path in Path(app.outdir).rglob("*.html"):
        name = path.relative_to(app.outdir).with_suffix("").as_posix()
        if error is None and name not in kept and not name.startswith("_"):
            path.unlink()


def setup(app: Any) -> dict[str, bool]:
    """Connect the functions above."""
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
