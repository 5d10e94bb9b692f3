"""Names in written pages lead to where they are documented: `simulate`, `lugre`, `symfric run`.

Between backticks a page says a name; the first mention in each section becomes a link.
"""

import re
from typing import Any

from docutils import nodes
from sphinx.addnodes import pending_xref

from docs.machine.api_pages import own_pages
from docs.machine.law_pages import MADE_OF_LAWS
from docs.machine.names import FRONTS, known
from symfric import ALL_LAWS, POPULATIONS
from symfric.cli.commands import COMMANDS
from symfric.scenes import ALL_SCENES

Place = tuple[str, str, str]
"""Domain, type and target of a link of Sphinx."""
COMMAND = re.compile(r"symfric ([\w-]+)\b")


def place(text: str) -> Place | None:
    """Where what stands between backticks is documented; None where it is no name of ours."""
    bare = text.removesuffix("()")
    if bare in ALL_LAWS or bare in POPULATIONS or bare in MADE_OF_LAWS:
        return "std", "doc", f"/laws/{bare}"
    if bare in ALL_SCENES:
        return "std", "doc", f"/scenes/{bare}"
    command = COMMAND.match(text)
    if command is not None and command[1] in COMMANDS:
        return "std", "ref", f"symfric-{command[1]}"
    if bare in FRONTS:
        return "std", "doc", f"/reference/{bare}"
    public = known().get(bare.rpartition(".")[2])
    if public is None or bare not in (public.name, public.full) or not callable(public.object):
        return None
    own = own_pages().get(id(public.object))
    return ("std", "doc", own) if own else ("py", "obj", public.full)


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
