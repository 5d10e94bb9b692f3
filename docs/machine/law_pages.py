"""A page of each law: formula, picture, facts and parameters, all of it from the code."""

import inspect
import re
from inspect import getdoc
from math import isfinite
from typing import Any

from docs.machine import rst
from docs.machine.docstrings import first_line, to_rst
from docs.machine.formula import name as symbol
from docs.machine.names import linked
from symfric import ALL_LAWS, POPULATIONS, parameters
from symfric.cli.laws import costs
from symfric.figures.magnitudes import phenomena
from symfric.foundation.parameters import options
from symfric.laws import PHENOMENA, AnyLaw
from symfric.laws.composed.compose import Asymmetric, LoadDependent, Sum
from symfric.laws.composed.isotropic import PlanarSlip, SpatialSlip
from symfric.laws.composed.wrap import Lagged, TemperatureDependent
from symfric.laws.cost import cost
from symfric.laws.static.table import Table

MADE_OF_LAWS: dict[str, type[Any]] = {
    "sum": Sum,
    "asymmetric": Asymmetric,
    "load_dependent": LoadDependent,
    "lagged": Lagged,
    "temperature_dependent": TemperatureDependent,
    "planar_slip": PlanarSlip,
    "spatial_slip": SpatialSlip,
    "table": Table,
}
"""Laws that need other laws or data; they have no defaults, hence no picture of their own."""

FAMILIES = {
    "Maps of the velocity": "The force follows from velocity and load alone. Smooth at rest, so "
    "that they creep under a load.",
    "With the applied force": "They hold what is applied at rest, and need to know it.",
    "With states": "Bristles, lag, ageing and modes: what friction remembers for a while.",
    "With non-local memory": "Closed loops inside loops: pre-sliding hysteresis as measured.",
    "Populations of contacts": "Many contacts that are made and lost at random: for figures, no "
    "scene takes them.",
    "Made of laws and data": "They wrap other laws, or take a table.",
}


def family(law: AnyLaw) -> str:
    """Where a law stands in the gallery."""
    if type(law) in POPULATIONS.values():
        return "Populations of contacts"
    if "M" in law.facts.phenomena and law.states:
        return "With non-local memory"
    if law.states:
        return "With states"
    return "With the applied force" if getattr(law, "inputs", ()) else "Maps of the velocity"


def every() -> dict[str, AnyLaw]:
    """Every law with defaults."""
    return {name: kind() for name, kind in (ALL_LAWS | POPULATIONS).items()}


def pages() -> dict[str, str]:
    """Name of each page, relative to `laws`, -> its text."""
    laws = every()
    found = {name: law_page(name, law) for name, law in laws.items()}
    found |= {name: wrapper_page(kind) for name, kind in MADE_OF_LAWS.items()}
    return found | {"index": index(laws)}


def index(laws: dict[str, AnyLaw]) -> str:
    """All laws by family, and what the codes mean."""
    text = rst.title("Laws")
    text += (
        f"{len(laws)} laws with default parameters, each as an equation, a picture and a table; "
        f"and {len(MADE_OF_LAWS)} that are made of laws or data. Names are those of "
        "``symfric laws NAME`` and of ``symfric run SCENE --law NAME``. What the letters under "
        "*shows* mean stands at the end; *instructions* are those of CasADi for force and rate, "
        "and for their derivatives; *formula* says what it was compared with, *unverified* that it "
        "was written from memory.\n\n"
    )
    for title, about in FAMILIES.items():
        text += rst.title(title, "-") + about + "\n\n"
        if title == "Made of laws and data":
            rows = [
                [f":doc:`{name} <{name}>`", rst.plain(first_line(kind.__doc__))]
                for name, kind in MADE_OF_LAWS.items()
            ]
            text += rst.table(["law", "what it is"], rows)
            text += rst.pages((f"{name} <{name}>" for name in MADE_OF_LAWS), hidden="")
            continue
        own = {name: law for name, law in laws.items() if family(law) == title}
        text += cards(own) + overview(own) + rst.pages((f"{n} <{n}>" for n in own), hidden="")
    text += rst.title("Codes", "-")
    return text + rst.table(
        ["code", "phenomenon"], [[c, rst.plain(said)] for c, said in PHENOMENA.items()]
    )


def overview(laws: dict[str, AnyLaw]) -> str:
    """A table of laws: what they show, how smooth they are and what they cost."""
    rows = [
        [
            f":doc:`{name} <{name}>`",
            " ".join(phenomena(law)),
            str(len(law.states)),
            rst.plain(law.facts.smoothness.split()[0]),
            f"{cost(law).value} / {cost(law).gradient}",
            rst.plain(law.facts.confidence),
        ]
        for name, law in laws.items()
    ]
    return rst.table(
        ["law", "shows", "states", "smoothness", "instructions", "formula"], rows, "numbers"
    )


def cards(laws: dict[str, AnyLaw]) -> str:
    """Small pictures that lead to the pages."""
    body = "".join(
        rst.directive(
            "figure", f"/made/laws/{name}_small.png", rst.plain(name) + "\n",
            target=f"{name}.html", alt=f"force of {name} in steady sliding",
        )
        for name in laws
    )  # fmt: skip
    return rst.directive("container", "cards", body)


def law_page(name: str, law: AnyLaw) -> str:
    """One law in full."""
    kind = type(law)
    doc = getdoc(kind) or ""
    text = rst.title(first_line(doc).split(":")[0].rstrip("."))
    text += (
        f"``{name}`` on the command line, ``from symfric import {kind.__name__}`` in Python.\n\n"
    )
    text += to_rst(without_title(doc), linked, symbols=True)
    about = f"{name}: what it does, with its default numbers"
    text += rst.directive("figure", f"/made/laws/{name}.png", alt=about)
    text += rst.title("Facts", "-") + facts(law)
    text += rst.title("Parameters", "-") + parameter_table(law)
    if options(law):
        rows = [
            [rst.code(o.name), rst.code(str(o.value)), ", ".join(o.choices), rst.plain(o.doc)]
            for o in options(law).values()
        ]
        text += rst.table(["option", "default", "choices", "meaning"], rows)
    if law.states:
        rows = [
            [rst.code(s.name), rst.plain(s.unit), f"{s.nominal:g}", rst.plain(s.doc or "-")]
            for s in law.states
        ]
        text += rst.title("States", "-")
        text += rst.table(["state", "unit", "typical", "meaning"], rows)
    if getattr(law, "inputs", ()):
        rows = [[rst.code(i.name), rst.plain(i.unit), rst.plain(i.doc)] for i in law.inputs]
        text += rst.title("Inputs besides v and N", "-")
        text += rst.table(["input", "unit", "meaning"], rows)
    return text + usage(name, law)


def wrapper_page(kind: type[Any]) -> str:
    """A law that takes laws or data."""
    doc = getdoc(kind) or ""
    text = rst.title(first_line(doc).split(":")[0].rstrip("."))
    text += to_rst(without_title(doc), linked, symbols=True)
    if kind in (PlanarSlip, SpatialSlip):
        base = kind.__mro__[1]
        text += rst.title(base.__name__, "-") + to_rst(getdoc(base) or "", linked, symbols=True)
    text += rst.title("In Python", "-")
    return text + rst.directive("py:class", f"symfric.{kind.__name__}{signature(kind)}")


def without_title(doc: str) -> str:
    """A docstring without its first line, unless that says more than a title."""
    first, _, rest = doc.partition("\n")
    return doc if ":" in first else rest.lstrip("\n")


def signature(kind: type[Any]) -> str:
    """Names and defaults, without types: all are numbers or symbols."""
    found = inspect.signature(kind)
    plain = [p.replace(annotation=inspect.Parameter.empty) for p in found.parameters.values()]
    text = str(found.replace(parameters=plain, return_annotation=inspect.Signature.empty))
    return re.sub(r"<[^>]*>", "...", text)


def facts(law: AnyLaw) -> str:
    """What is known about a law."""
    instructions = cost(law)
    rows = [
        ["shows", ", ".join(rst.plain(PHENOMENA[code]) for code in phenomena(law)) or "-"],
        ["smoothness", rst.plain(law.facts.smoothness)],
        ["load", rst.plain(law.facts.load)],
        ["symmetry", "odd in the motion" if law.facts.odd else "not odd"],
        [
            "cost",
            f"{instructions.value} CasADi instructions for {costs(law)}, {instructions.gradient} "
            "for their derivatives",
        ],
        ["source", rst.plain(law.facts.source)],
        ["formula", rst.plain(law.facts.formula)],
    ]
    rows += [["warning", rst.plain(warning)] for warning in law.warnings()]
    return rst.table((), rows)


def parameter_table(law: Any) -> str:
    """Parameters of a law or a scene: symbol, default, unit, bounds."""
    rows = [
        [
            rst.code(p.name),
            shown_symbol(p.name),
            number(float(p.value)),
            rst.plain(p.unit),
            _bounds(p.lower, p.upper),
            rst.plain(p.doc),
        ]
        for p in parameters(law).values()
    ]
    return rst.table(["parameter", "", "default", "unit", "range", "meaning"], rows, "numbers")


def shown_symbol(name: str) -> str:
    """The symbol of a parameter as a formula, where its name is one."""
    try:
        return f":math:`{symbol(name)}`"
    except KeyError:
        return ""


def number(value: float) -> str:
    """Six digits."""
    return f"{value:.6g}"


def _bounds(lower: float, upper: float) -> str:
    if not isfinite(lower) and not isfinite(upper):
        return "any"
    if not isfinite(upper):
        return f"≥ {lower:g}"
    return f"{lower:g} ... {upper:g}" if isfinite(lower) else f"≤ {upper:g}"


def usage(name: str, law: AnyLaw) -> str:
    """How to see more of it."""
    lines = [f"$ symfric laws {name}"]
    if {"P", "M"} & set(phenomena(law)) and law.states:
        lines.append(f"$ symfric laws {name} --figure hysteresis --plot {name}.png")
    if type(law) in ALL_LAWS.values() and not getattr(law, "inputs", ()):
        lines.append(f"$ symfric run rabinowicz --law {name} --plot run.png")
    text = rst.title("Use", "-") + rst.literal("\n".join(lines), "console")
    kind = type(law)
    return text + rst.directive("py:class", f"symfric.{kind.__name__}{signature(kind)}")
