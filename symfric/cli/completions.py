"""Shell completions: names of laws, scenes, figures, problems, and parameters of `--set`.

These functions never print or raise; without a match they return an empty list.
"""

from collections.abc import Iterable
from typing import Any

import typer

from symfric.foundation.parameters import options, parameters
from symfric.laws import ALL_LAWS, POPULATIONS, Law, any_from_text


def _of(names: Iterable[str], incomplete: str) -> list[str]:
    return [name for name in names if name.startswith(incomplete)]


def laws(incomplete: str) -> list[str]:
    """Complete laws of a scene, also in sums and wrappers."""
    cut = max(incomplete.rfind(c) for c in "+(") + 1
    return [incomplete[:cut] + name for name in _of(ALL_LAWS, incomplete[cut:])]


def each_law(incomplete: str) -> list[str]:
    """Complete laws in a list with commas."""
    start, comma, last = incomplete.rpartition(",")
    return [f"{start}{comma}{name}" for name in laws(last)]


def needs(incomplete: str) -> list[str]:
    """Complete words of `--need` in a list with commas."""
    from symfric.choice import NEEDS  # noqa: PLC0415  (for one command only)

    start, comma, last = incomplete.rpartition(",")
    return [f"{start}{comma}{word}" for word in _of(NEEDS, last)]


def all_laws(incomplete: str) -> list[str]:
    """Complete laws and populations of random contacts."""
    return [*laws(incomplete), *_of(POPULATIONS, incomplete)]


def scenes(incomplete: str) -> list[str]:
    """Complete scenes; the shell completes files of robots."""
    from symfric.scenes import ALL_SCENES  # noqa: PLC0415  (of these commands only)

    return _of(ALL_SCENES, incomplete)


def presets(context: typer.Context, incomplete: str) -> list[str]:
    """Complete presets of the scene on the command line."""
    return _of((name for kind in _machines(context) for name in kind.presets), incomplete)


def places(context: typer.Context, incomplete: str) -> list[str]:
    """Complete `PLACE=LAW` for the scene on the command line."""
    place, equals, law = incomplete.partition("=")
    if equals:
        return [f"{place}={name}" for name in laws(law)]
    return _of((f"{name}=" for kind in _machines(context) for name in kind.places()), incomplete)


def _machines(context: typer.Context) -> list[Any]:
    from symfric.scenes import ALL_SCENES  # noqa: PLC0415  (of these commands only)

    words = (context.params.get("scene"), context.params.get("what"), *context.args)
    return [ALL_SCENES[word] for word in map(str, words) if word in ALL_SCENES]


def figures(incomplete: str) -> list[str]:
    """Complete figures of laws, and scenes."""
    from symfric.figures import FIGURES  # noqa: PLC0415  (for this command only)

    return [*_of(FIGURES, incomplete), *scenes(incomplete)]


def plates(incomplete: str) -> list[str]:
    """Complete papers of the gallery and, after the slash, their figures."""
    from symfric.gallery.plate import scripts, short  # noqa: PLC0415  (for this command only)

    names = [short(name) for name in scripts()]
    papers = dict.fromkeys(f"{name.partition('/')[0]}/" for name in names)
    return _of(names if "/" in incomplete else papers, incomplete)


def problems(incomplete: str) -> list[str]:
    """Complete ready optimal control problems."""
    from ocp.problems import READY  # noqa: PLC0415  (for this command only)

    return _of(READY, incomplete)


def settings(context: typer.Context, incomplete: str) -> list[str]:
    """Complete `NAME=` of parameters and options of the laws, or of the scene with them."""
    from symfric.scenes import ALL_SCENES  # noqa: PLC0415  (of these commands only)

    words = [str(word) for word in context.args]  # arguments before the option that is completed
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
