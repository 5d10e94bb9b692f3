"""Where a name is documented, as domain, type and target of a link; needs no Sphinx."""

import re

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
