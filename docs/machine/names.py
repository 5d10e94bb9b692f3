"""The public names of the packages: where each is handed out, and where its page is."""

import ast
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from typing import Any, final

from docs.machine.pages import ROOT

FRONTS = {
    "symfric": "Laws, models, simulation and figures: what most programs import.",
    "ocp": "Optimal control that lands where it says.",
    "ocp.mpc": "Controllers with a receding horizon.",
    "identification": "Friction from measured data.",
    "symfric.laws": "What laws are made of.",
    "symfric.model": "The interface between equations and solvers.",
    "symfric.multibody": "Mechanisms: bodies, joints, loads.",
    "symfric.scenes": "Ready machines; each has a page of its own in the gallery of scenes.",
    "symfric.figures": "What laws do, as data and pictures.",
    "symfric.integrator": "Simulation, its settings and results.",
    "symfric.choice": "Which law for which machine.",
    "symfric.codegen": "C of laws, plants and robots.",
    "symfric.compensation": "Friction compensators and observers, in Python and in C.",
    "symfric.fmu": "Functional Mock-up Units.",
    "symfric.gallery": "Figures of the papers.",
    "symfric.results.pictures": "Pictures of runs.",
    "symfric.results.animation": "Films of machines.",
}
"""Modules that hand out names, each with its subject; a name stands at the first that has it."""


@final
@dataclass(frozen=True)
class Public:
    """A public name: `front.name` is the object, whose source is in `module`."""

    front: str
    name: str
    module: str

    @property
    def full(self) -> str:
        """The name by which it is imported."""
        return f"{self.front}.{self.name}"

    @property
    def object(self) -> Any:
        """The object itself."""
        return getattr(import_module(self.front), self.name)


def source_of(front: str, name: str) -> str:
    """The module in which a name that a front hands out is defined."""
    for public in handed_out(front):
        if public.name == name and public.module != front:
            return source_of(public.module, name)
    return front


def handed_out(front: str) -> list[Public]:
    """The names that a front hands out, or that a module of functions defines."""
    path = ROOT.joinpath(*front.split("."))
    if not path.is_dir():
        module = import_module(front)
        own = [n for n, o in vars(module).items() if getattr(o, "__module__", "") == front]
        return [Public(front, n, front) for n in own if not n.startswith("_") and n[0].islower()]
    init = path / "__init__.py"
    if not init.exists():
        return []
    tree = ast.parse(init.read_text("utf-8"))
    found: list[Public] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module:
            names = [a.name for a in node.names if a.asname == a.name]
            if node.names[0].name == "*":
                names = [public.name for public in handed_out(node.module)]
            found += [Public(front, name, node.module) for name in names]
    return list({p.name: p for p in found}.values())


@cache
def catalogue() -> dict[str, list[Public]]:
    """Front -> its names, each object only at the first front that hands it out."""
    seen: set[int] = set()
    found: dict[str, list[Public]] = {}
    for front in FRONTS:
        found[front] = []
        for public in handed_out(front):
            item = public.object
            if id(item) not in seen:
                seen.add(id(item))
                found[front].append(public)
    return found


@cache
def known() -> dict[str, Public]:
    """Short name -> where it is documented; names that are two things are left out."""
    every = [p for names in catalogue().values() for p in names]
    counted: dict[str, list[Public]] = {}
    for public in every:
        counted.setdefault(public.name, []).append(public)
    return {name: found[0] for name, found in counted.items() if len(found) == 1}


def linked(text: str) -> str:
    """A name between backticks as a link to where it is documented, else as code."""
    bare = text.removesuffix("()")
    public = known().get(bare) or known().get(bare.rpartition(".")[2] if "." in bare else "")
    if public is None or (callable(public.object) is False):
        return f"``{text}``"
    if bare not in (public.name, public.full):
        return f"``{text}``"
    return f":py:obj:`{text} <{public.full}>`"
