"""Pages of laws and scenes: formula, picture, facts and parameters, all of it from the code."""

import inspect
import re
from inspect import getdoc
from math import isfinite
from pathlib import Path
from typing import Any

from docs.machine import rst
from docs.machine.formula import name as symbol
from docs.machine.names import linked
from docs.machine.rst import first_line, sentence, to_rst
from symfric import ALL_LAWS, POPULATIONS, BrownMcPhee, law_name, parameters
from symfric.cli.laws import costs
from symfric.figures.data import phenomena
from symfric.foundation.parameters import options
from symfric.laws import PHENOMENA, AnyLaw
from symfric.laws.composed.compose import Asymmetric, LoadDependent, Sum
from symfric.laws.composed.isotropic import PlanarSlip, SpatialSlip
from symfric.laws.composed.populations import cost
from symfric.laws.composed.wrap import Lagged, TemperatureDependent
from symfric.laws.static.coulomb import Table
from symfric.scenes import ALL_SCENES, Scene

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
    """The family of a law in the gallery."""
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


def law_pages() -> dict[str, str]:
    """Name of each page, relative to `laws`, -> its text."""
    laws = every()
    found = {name: law_page(name, law) for name, law in laws.items()}
    found |= {name: wrapper_page(kind) for name, kind in MADE_OF_LAWS.items()}
    return found | {"index": law_index(laws)}


def law_index(laws: dict[str, AnyLaw]) -> str:
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
    """Facts about a law."""
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
    """Commands and code that show more of it."""
    lines = [f"$ symfric laws {name}"]
    if {"P", "M"} & set(phenomena(law)) and law.states:
        lines.append(f"$ symfric laws {name} --figure hysteresis --plot {name}.png")
    if type(law) in ALL_LAWS.values() and not getattr(law, "inputs", ()):
        lines.append(f"$ symfric run rabinowicz --law {name} --plot run.png")
    text = rst.title("Use", "-") + rst.literal("\n".join(lines), "console")
    kind = type(law)
    return text + rst.directive("py:class", f"symfric.{kind.__name__}{signature(kind)}")


RUBS = BrownMcPhee
"""What rubs in the pictures: runs in every machine, whatever its load."""
RUBS_NAME = law_name(RUBS())


def scene_pages() -> dict[str, str]:
    """Name of each page, relative to `scenes`, -> its text."""
    return {name: scene_page(name, kind) for name, kind in ALL_SCENES.items()} | {
        "index": scene_index()
    }


def scene_index() -> str:
    """All scenes in a table."""
    text = rst.title("Scenes")
    text += (
        "Ready machines: each takes any friction law and gives a :py:obj:`Model "
        "<symfric.Model>`. Names are those of ``symfric run SCENE --law NAME``.\n\n"
    )
    rows = []
    for name, kind in ALL_SCENES.items():
        model = kind(RUBS()).model()
        presets = ", ".join(f"``{p}``" for p in kind.presets) or "-"
        said = sentence(first_line(kind.__doc__), linked)
        rows.append([f":doc:`{name} <{name}>`", said, str(len(model.x)), presets])
    text += rst.table(["scene", "what it is", "states", "presets"], rows)
    return text + rst.pages((f"{name} <{name}>" for name in ALL_SCENES), hidden="")


def scene_page(name: str, kind: type[Scene]) -> str:
    """One scene in full."""
    scene = kind(RUBS())
    model = scene.model()
    doc = getdoc(kind) or ""
    text = rst.title(name.replace("_", " ").capitalize())
    text += f"``{name}`` on the command line, "
    text += f"``from symfric.scenes import {kind.__name__}`` in Python.\n\n"
    text += to_rst(doc, linked, symbols=True)
    if model.sketch is not None:
        about = f"{name} at an instant of this run"
        text += rst.directive("figure", f"/made/scenes/{name}_sketch.png", alt=about, width="24rem")
    command = f"symfric run {name} --law {RUBS_NAME}"
    said = f"{name} with {RUBS_NAME} friction over {kind.t_end:g} s, by ``{command}``"
    text += rst.directive("figure", f"/made/scenes/{name}.png", said + "\n", alt=f"run of {name}")
    text += rst.title("Parameters", "-") + machine_table(scene)
    if kind.presets:
        rows = [
            [f"``{n}``", sentence(p.doc, linked), sentence(p.source, linked)]
            for n, p in kind.presets.items()
        ]
        text += rst.title("Presets", "-")
        text += f"``{kind.__name__}.preset(NAME, law)``, ``symfric run {name} --preset NAME``.\n\n"
        text += rst.table(["preset", "what it is", "source"], rows)
    places = kind.places()
    if places:
        rows = [[f"``{n}``", sentence(doc, linked)] for n, doc in places.items()]
        text += rst.title("Places that rub", "-")
        text += "Each may have a law of its own: ``--law-of PLACE=LAW``.\n\n"
        text += rst.table(["place", "what it is"], rows)
    text += signals(kind, model) + rst.title("In Python", "-")
    return text + rst.directive("py:class", f"symfric.scenes.{kind.__name__}{signature(kind)}")


def machine_table(scene: Scene) -> str:
    """Parameters of the machine, without those of its laws."""
    own = [p for p in parameters(scene).values() if p.name not in parameters(scene.law)]
    rows = [
        [
            rst.code(p.name),
            shown_symbol(p.name),
            number(float(p.value)),
            rst.plain(p.unit),
            rst.plain(p.doc),
        ]
        for p in own
    ]
    return rst.table(["parameter", "", "default", "unit", "meaning"], rows, "numbers")


def signals(kind: type[Scene], model: Any) -> str:
    """Inputs, states and outputs with their units."""
    text = ""
    if model.u:
        rows = [
            [
                rst.code(u.name),
                rst.plain(u.unit),
                rst.plain(kind.inputs[u.name].text if u.name in kind.inputs else "0"),
                rst.plain(u.doc or "-"),
            ]
            for u in model.u
        ]
        text += rst.title("Inputs", "-")
        text += rst.table(["input", "unit", "where none is given", "meaning"], rows)
    rows = [[rst.code(v.name), rst.plain(v.unit), rst.plain(v.doc or "state")] for v in model.x]
    rows += [
        [rst.code(n), rst.plain(o.unit), rst.plain(o.kind or "-")] for n, o in model.outputs.items()
    ]
    details = [n for n in model.details() if n not in model.outputs]
    text += rst.title("Signals", "-")
    text += rst.table(["signal", "unit", "what it is"], rows)
    if details:
        shown = ", ".join(rst.code(n) for n in details[:60])
        more = f" and {len(details) - 60} more" if len(details) > 60 else ""
        text += f"On request (``run[name]``): {shown}{more}.\n\n"
    return text


def draw_scene(name: str, folder: Path) -> None:
    """The run of a scene, and the machine at an instant of it."""
    import numpy as np  # noqa: PLC0415  (in the process that draws)

    from symfric import simulate  # noqa: PLC0415
    from symfric.results.animation import picture  # noqa: PLC0415

    kind = ALL_SCENES[name]
    model = kind(RUBS()).model()
    inputs = {n: given.function for n, given in kind.inputs.items()}
    run = simulate(model, kind.t_end, u=inputs or None)
    run.plot(path=folder / f"{name}.png")
    if model.sketch is not None:
        figure, pose = picture(run, np.linspace(0.0, kind.t_end, 40))
        pose(3)  # most machines move then
        figure.savefig(folder / f"{name}_sketch.png", dpi=110)
