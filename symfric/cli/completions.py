"""Shell completions: names of laws, scenes, figures, problems, and parameters of `--set`.

These functions never print or raise; without a match they return an empty list. They import what
one command needs only.
"""

from collections.abc import Iterable
from importlib import import_module
from typing import Any

import typer

from symfric.foundation.parameters import options, parameters
from symfric.laws import ALL_LAWS, POPULATIONS, Law, any_from_text


def _of(names: Iterable[str], incomplete: str) -> list[str]:
    return [name for name in names if name.startswith(incomplete)]


def _last(names: Iterable[str], incomplete: str, separators: str = ",") -> list[str]:
    """Complete the part of a text behind the last of its separators."""
    cut = max(map(incomplete.rfind, separators)) + 1
    return [incomplete[:cut] + name for name in _of(names, incomplete[cut:])]


def _from(module: str, name: str) -> Any:
    return getattr(import_module(module), name)


def laws(incomplete: str) -> list[str]:
    """Complete laws of a scene, also in sums and wrappers."""
    return _last(ALL_LAWS, incomplete, "+(")


def each_law(incomplete: str) -> list[str]:
    """Complete laws in a list with commas."""
    return _last(ALL_LAWS, incomplete, "+(,")


def needs(incomplete: str) -> list[str]:
    """Complete words of `--need` in a list with commas."""
    return _last(_from("symfric.choice", "NEEDS"), incomplete)


def all_laws(incomplete: str) -> list[str]:
    """Complete laws and populations of random contacts."""
    return [*laws(incomplete), *_of(POPULATIONS, incomplete)]


def scenes(incomplete: str) -> list[str]:
    """Complete scenes; the shell completes files of robots."""
    return _of(_from("symfric.scenes", "ALL_SCENES"), incomplete)


def presets(context: typer.Context, incomplete: str) -> list[str]:
    """Complete presets of the scene on the command line."""
    return _of((name for kind in _machines(context) for name in kind.presets), incomplete)


def places(context: typer.Context, incomplete: str) -> list[str]:
    """Complete `PLACE=LAW` for the scene on the command line."""
    if "=" in incomplete:
        return _last(ALL_LAWS, incomplete, "=+(")
    return _of((f"{name}=" for kind in _machines(context) for name in kind.places()), incomplete)


def _machines(context: typer.Context) -> list[Any]:
    """Return the scenes on the command line."""
    every = _from("symfric.scenes", "ALL_SCENES")
    words = (context.params.get("scene"), context.params.get("what"), *context.args)
    return [every[word] for word in map(str, words) if word in every]


def figures(incomplete: str) -> list[str]:
    """Complete figures of laws, and scenes."""
    return [*_of(_from("symfric.figures", "FIGURES"), incomplete), *scenes(incomplete)]


def plates(incomplete: str) -> list[str]:
    """Complete papers of the gallery and, after the slash, their figures."""
    short = _from("symfric.gallery", "short")
    names = [short(name) for name in _from("symfric.gallery", "scripts")()]
    papers = dict.fromkeys(f"{name.partition('/')[0]}/" for name in names)
    return _of(names if "/" in incomplete else papers, incomplete)


def subjects(incomplete: str) -> list[str]:
    """Complete subjects of `symfric bench`."""
    return _of(_from("symfric.bench", "SUBJECTS"), incomplete)


def problems(incomplete: str) -> list[str]:
    """Complete ready optimal control problems."""
    return _of(_from("ocp.problems", "READY"), incomplete)


def settings(context: typer.Context, incomplete: str) -> list[str]:
    """Complete `NAME=` of parameters and options of the laws, or of the scene with them."""
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
