"""Names in written pages lead to where they are documented: `simulate`, `lugre`, `symfric run`.

Between backticks a page says a name; the first mention in each section becomes a link.
"""

from typing import Any

from docutils import nodes
from sphinx.addnodes import pending_xref

from docs.machine.places import Place, place


def link(app: Any, tree: nodes.document) -> None:
    """Make links of the names in a page that somebody wrote."""
    name = app.env.docname
    if not str(app.env.doc2path(name)).endswith(".md") or name == "changelog":
        return
    seen: set[tuple[int, Place]] = set()
    for literal in [*tree.findall(nodes.literal)]:
        found = place(literal.astext())
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
    """What holds a node, the nearest first."""
    found: list[nodes.Node] = []
    while node.parent is not None:
        node = node.parent
        found.append(node)
    return found
