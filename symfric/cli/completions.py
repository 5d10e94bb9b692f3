"""Shell completions: names of laws, scenes, figures and problems, and parameters of `--set`.

These functions never print or raise; without a match they return an empty list. They import only
the modules that the completed command needs.
"""

from collections.abc import Callable, Iterable
from importlib import import_module
from typing import Any

import typer

from symfric.foundation.parameters import options, parameters
from symfric.laws import ALL_LAWS, POPULATIONS, Law, any_from_text


def _of(names: Iterable[str], incomplete: str) -> list[str]:
    return [name for name in names if name.startswith(incomplete)]


def _last(names: Iterable[str], incomplete: str, separators: str = ",") -> list[str]:
    """Return completions of the part of a text after its last separator."""
    cut = max(map(incomplete.rfind, separators)) + 1
    return [incomplete[:cut] + name for name in _of(names, incomplete[cut:])]


def _names(module: str, name: str, separators: str = "") -> Callable[[str], list[str]]:
    """Return a function that completes the entries of `name` in `module`."""

    def complete(incomplete: str) -> list[str]:
        names = getattr(import_module(module), name)
        return _last(names, incomplete, separators) if separators else _of(names, incomplete)

    return complete


laws = _names("symfric.laws", "ALL_LAWS", "+(")
each_law = _names("symfric.laws", "ALL_LAWS", "+(,")
needs = _names("symfric.choice", "NEEDS", ",")
scenes = _names("symfric.scenes", "ALL_SCENES")
subjects = _names("symfric.bench", "SUBJECTS")
problems = _names("ocp.problems", "READY")


def all_laws(incomplete: str) -> list[str]:
    """Return completions among laws and populations of random contacts."""
    return [*laws(incomplete), *_of(POPULATIONS, incomplete)]


def figures(incomplete: str) -> list[str]:
    """Return completions among figures of laws and scenes."""
    return [*_names("symfric.figures", "FIGURES")(incomplete), *scenes(incomplete)]


def plates(incomplete: str) -> list[str]:
    """Return completions among papers of the gallery or, after the slash, their figures."""
    from symfric.gallery import scripts, short  # noqa: PLC0415  (for this completion only)

    names = [short(name) for name in scripts()]
    papers = dict.fromkeys(f"{name.partition('/')[0]}/" for name in names)
    return _of(names if "/" in incomplete else papers, incomplete)


def presets(context: typer.Context, incomplete: str) -> list[str]:
    """Return completions among presets of the scene on the command line."""
    return _of((name for kind in _machines(context) for name in kind.presets), incomplete)


def places(context: typer.Context, incomplete: str) -> list[str]:
    """Return completions of `PLACE=LAW` for the scene on the command line."""
    if "=" in incomplete:
        return _last(ALL_LAWS, incomplete, "=+(")
    return _of((f"{name}=" for kind in _machines(context) for name in kind.places()), incomplete)


def _machines(context: typer.Context) -> list[Any]:
    """Return the scenes on the command line."""
    from symfric.scenes import ALL_SCENES  # noqa: PLC0415  (for these completions only)

    words = (context.params.get("scene"), context.params.get("what"), *context.args)
    return [ALL_SCENES[word] for word in map(str, words) if word in ALL_SCENES]


def settings(context: typer.Context, incomplete: str) -> list[str]:
    """Return completions of `NAME=` for the laws, or for the scene with the laws."""
    machines, named = _machines(context), context.params.get("law") or context.params.get("name")
    texts = [named] if isinstance(named, str) else list(named or ())
    if not (texts or machines):
        texts = [str(word) for word in context.args]  # before the option that is completed
    found = dict[str, None]()
    for text in texts or ["viscous"]:
        try:
            law = any_from_text(text)
        except ValueError:
            continue
        if machines and isinstance(law, Law):
            found |= dict.fromkeys(parameters(machines[0](law)))
        else:
            found |= dict.fromkeys([*parameters(law), *options(law)])
    return _of((f"{name}=" for name in found), incomplete)
