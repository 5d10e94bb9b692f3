"""Completions of the shell: names of laws, scenes, figures, problems, parameters of `--set`.

Nothing is said and nothing raised here: a completion that cannot be found is none.
"""

from collections.abc import Iterable
from typing import Any

import typer

from symfric.foundation.parameters import options, parameters
from symfric.laws import ALL_LAWS, POPULATIONS, Law, any_from_text


def _of(names: Iterable[str], incomplete: str) -> list[str]:
    return [name for name in names if name.startswith(incomplete)]


def laws(incomplete: str) -> list[str]:
    """Laws that go into a scene; the last part of a sum or inside a wrapper, too."""
    cut = max(incomplete.rfind(c) for c in "+(") + 1
    return [incomplete[:cut] + name for name in _of(ALL_LAWS, incomplete[cut:])]


def each_law(incomplete: str) -> list[str]:
    """Laws in a list with commas."""
    start, comma, last = incomplete.rpartition(",")
    return [f"{start}{comma}{name}" for name in laws(last)]


def needs(incomplete: str) -> list[str]:
    """Words of `--need`, in a list with commas."""
    from symfric.choice import NEEDS  # noqa: PLC0415  (of one command only)

    start, comma, last = incomplete.rpartition(",")
    return [f"{start}{comma}{word}" for word in _of(NEEDS, last)]


def all_laws(incomplete: str) -> list[str]:
    """Laws, and populations of random contacts."""
    return [*laws(incomplete), *_of(POPULATIONS, incomplete)]


def scenes(incomplete: str) -> list[str]:
    """Machines, and files of robots by the shell's own means."""
    from symfric.scenes import ALL_SCENES  # noqa: PLC0415  (of these commands only)

    return _of(ALL_SCENES, incomplete)


def presets(context: typer.Context, incomplete: str) -> list[str]:
    """Papers whose numbers the scene on the line has."""
    return _of((name for kind in _machines(context) for name in kind.presets), incomplete)


def places(context: typer.Context, incomplete: str) -> list[str]:
    """`PLACE=` and a law, of the scene on the line."""
    place, equals, law = incomplete.partition("=")
    if equals:
        return [f"{place}={name}" for name in laws(law)]
    return _of((f"{name}=" for kind in _machines(context) for name in kind.places()), incomplete)


def _machines(context: typer.Context) -> list[Any]:
    from symfric.scenes import ALL_SCENES  # noqa: PLC0415  (of these commands only)

    words = (context.params.get("scene"), context.params.get("what"), *context.args)
    return [ALL_SCENES[word] for word in map(str, words) if word in ALL_SCENES]


def figures(incomplete: str) -> list[str]:
    """Behaviours of laws, and machines that show one."""
    from symfric.figures import FIGURES  # noqa: PLC0415  (of this command only)

    return [*_of(FIGURES, incomplete), *scenes(incomplete)]


def plates(incomplete: str) -> list[str]:
    """Papers of the gallery, and behind the slash their figures."""
    from symfric.gallery.plate import scripts, short  # noqa: PLC0415  (of this command only)

    names = [short(name) for name in scripts()]
    papers = dict.fromkeys(f"{name.partition('/')[0]}/" for name in names)
    return _of(names if "/" in incomplete else papers, incomplete)


def problems(incomplete: str) -> list[str]:
    """Ready problems of optimal control."""
    from ocp.problems import READY  # noqa: PLC0415  (of this command only)

    return _of(READY, incomplete)


def settings(context: typer.Context, incomplete: str) -> list[str]:
    """`NAME=` of the parameters and options of the laws, or of the scene with them."""
    from symfric.scenes import ALL_SCENES  # noqa: PLC0415  (of these commands only)

    words = [str(word) for word in context.args]  # arguments before an option without its value
    named = context.params.get("law") or context.params.get("name") or []
    machines = [w for w in (str(context.params.get("scene")), *words) if w in ALL_SCENES]
    texts = [named] if isinstance(named, str) else [*named]
    if not (texts or machines):
        texts = words
    found = dict[str, None]()
    for text in texts or ["viscous"]:
        try:
            law = any_from_text(text)
        except ValueError:
            continue
        if machines and isinstance(law, Law):
            found |= dict.fromkeys(parameters(ALL_SCENES[machines[0]](law)))
        else:
            found |= dict.fromkeys([*parameters(law), *options(law)])
    return _of((f"{name}=" for name in found), incomplete)
