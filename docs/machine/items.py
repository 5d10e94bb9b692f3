"""Pages of laws and scenes from the code: formula, picture, facts and parameters."""

import inspect
import re
from collections.abc import Iterable, Mapping
from math import isfinite
from pathlib import Path
from typing import Any

from docs.machine.docstrings import first_line
from docs.machine.docstrings import name as symbol
from docs.machine.markdown import TEXTS, block, code, contents, directive, opening, plain, table
from symfric import ALL_LAWS, POPULATIONS, BrownMcPhee, Exact, Table, law_name, parameters
from symfric.cli.laws import costs
from symfric.figures.data import phenomena
from symfric.foundation.parameters import options
from symfric.laws import (
    PHENOMENA,
    AnyLaw,
    Asymmetric,
    LoadDependent,
    PlanarSlip,
    Population,
    SpatialSlip,
    Sum,
)
from symfric.laws.composed.populations import cost
from symfric.laws.composed.wrap import Lagged, LoadNormalised, TemperatureDependent
from symfric.scenes import ALL_SCENES, Scene

MADE_OF_LAWS: dict[str, type[Any]] = {
    "sum": Sum,
    "asymmetric": Asymmetric,
    "exact": Exact,
    "load_dependent": LoadDependent,
    "load_normalised": LoadNormalised,
    "lagged": Lagged,
    "temperature_dependent": TemperatureDependent,
    "planar_slip": PlanarSlip,
    "spatial_slip": SpatialSlip,
    "table": Table,
}
"""Laws that need other laws or data; without defaults, they have no picture."""
LAW_PAGES: Mapping[str, type[Any]] = ALL_LAWS | POPULATIONS | MADE_OF_LAWS
"""Name of the page -> class."""

WITH_DATA = "Made of laws and data"
FAMILIES = TEXTS["families"]


def family(law: AnyLaw) -> str:
    """Return the family of a law in the gallery."""
    if type(law) in POPULATIONS.values():
        return "Populations of contacts"
    if "M" in law.facts.phenomena and law.states:
        return "With non-local memory"
    if law.states:
        return "With states"
    return "With the applied force" if getattr(law, "inputs", ()) else "Maps of the velocity"


def every() -> dict[str, AnyLaw]:
    """Return every law with defaults."""
    return {name: kind() for name, kind in (ALL_LAWS | POPULATIONS).items()}


def law_pages() -> dict[str, str]:
    """Return the text of each page, by its name relative to `laws`."""
    laws = every()
    found = {name: law_page(name, law) for name, law in laws.items()}
    found |= {name: entry(kind, f"symfric.{kind.__name__}") for name, kind in MADE_OF_LAWS.items()}
    return found | {"index": law_index(laws)}


def law_index(laws: Mapping[str, AnyLaw]) -> str:
    """Return all laws by family, and the meaning of the codes."""
    text = opening("laws", count=len(laws), made=len(MADE_OF_LAWS))
    for title, about in FAMILIES.items():
        text += f"## {title}\n\n{about}\n\n"
        if title == WITH_DATA:
            rows = [[f"[{n}]({n}.md)", first_line(k.__doc__)] for n, k in MADE_OF_LAWS.items()]
            text += table(["law", "description"], rows) + contents(MADE_OF_LAWS)
            continue
        own = {name: law for name, law in laws.items() if family(law) == title}
        text += cards((f"/made/laws/{n}_small.png", n, n, f"force of {n} in sliding") for n in own)
        rows = [
            [f"[{name}]({name}.md)", " ".join(phenomena(law)), len(law.states),
             law.facts.smoothness.split()[0], f"{cost(law).value} / {cost(law).gradient}",
             plain(law.facts.confidence)]
            for name, law in own.items()
        ]  # fmt: skip
        head = ["law", "shows", "states", "smoothness", "instructions", "formula"]
        text += table(head, rows, "numbers") + contents(own)
    return text + "## Codes\n\n" + table(["code", "phenomenon"], PHENOMENA.items())


def cards(pictures: Iterable[tuple[str, str, str, str]], kind: str = "cards") -> str:
    """Return small pictures: file, page, caption and alternative text of each."""
    return directive("container", kind, "".join(
        directive("figure", file, caption, target=f"{page}.html", alt=plain(alt))
        for file, page, caption, alt in pictures
    ))  # fmt: skip


def entry(kind: type[Any], full: str) -> str:
    """Return the title and the documentation of a law or a scene."""
    title = first_line(kind.__doc__).split(":")[0].rstrip(".")
    text = f"# {plain(title)}\n\n" + directive("eval-rst", "", f".. autoclass:: {full}\n")
    if kind in (PlanarSlip, SpatialSlip):
        base = kind.__mro__[1]
        rst = f".. autoclass:: {base.__module__}.{base.__name__}\n   :no-index:\n"
        text += f"## {base.__name__}\n\n" + directive("eval-rst", "", rst)
    return text


def law_page(name: str, law: AnyLaw) -> str:
    """Return the page of one law."""
    kind, instructions = type(law), cost(law)
    text = entry(kind, f"symfric.{kind.__name__}")
    text += f"The name on the command line is `{name}`. In Python, use "
    text += f"`from symfric import {kind.__name__}`.\n\n"
    text += directive("figure", f"/made/laws/{name}.png", alt=f"{name} with default parameters")
    text += sliders_of(name, law)
    facts = [
        ["shows", ", ".join(PHENOMENA[code] for code in phenomena(law))],
        ["smoothness", law.facts.smoothness],
        ["load", law.facts.load],
        ["symmetry", "odd in the motion" if law.facts.odd else "not odd"],
        ["cost", f"{instructions.value} CasADi instructions for {costs(law)}, "
         f"{instructions.gradient} for their derivatives"],
        ["source", law.facts.source],
        ["formula", law.facts.formula],
        *(["warning", warning] for warning in law.warnings()),
    ]  # fmt: skip
    text += "## Facts\n\n" + table((), [[k, plain(v)] for k, v in facts])
    text += "## Parameters\n\n" + parameter_table(parameters(law).values())
    if options(law):
        rows = [
            [code(o.name), code(str(o.value)), ", ".join(o.choices), plain(o.doc)]
            for o in options(law).values()
        ]
        text += table(["option", "default", "choices", "meaning"], rows)
    if law.states:
        rows = [[code(s.name), s.unit, f"{s.nominal:g}", plain(s.doc)] for s in law.states]
        text += "## States\n\n" + table(["state", "unit", "typical", "meaning"], rows)
    if getattr(law, "inputs", ()):
        rows = [[code(i.name), i.unit, plain(i.doc)] for i in law.inputs]
        text += "## Further inputs\n\n" + table(["input", "unit", "meaning"], rows)
    lines = [f"$ symfric laws {name}"]
    if {"P", "M"} & set(phenomena(law)) and law.states:
        lines.append(f"$ symfric laws {name} --figure hysteresis --plot {name}.png")
    if type(law) in ALL_LAWS.values() and not getattr(law, "inputs", ()):
        lines.append(f"$ symfric run rabinowicz --law {name} --plot run.png")
    return text + "## Use\n\n" + block("\n".join(lines), "console")


def sliders_of(name: str, law: AnyLaw) -> str:
    """Return the section with the sliders of a law, or the reason why it has none."""
    said = TEXTS["sliders"]
    if isinstance(law, Population):
        return f"{said['population']}\n\n"
    raw = directive("raw", "html", file=f"../made/sliders/{name}.html")
    return f"## {said['title']}\n\n{said['text']}{raw}"


def signature(kind: type[Any]) -> str:
    """Return names and defaults without types: all are numbers or symbols."""
    found = inspect.signature(kind)
    bare = [p.replace(annotation=inspect.Parameter.empty) for p in found.parameters.values()]
    text = str(found.replace(parameters=bare, return_annotation=inspect.Signature.empty))
    return re.sub(r"<[^>]*>", "...", text)


def parameter_table(chosen: Iterable[Any]) -> str:
    """Return a table of parameters of a law or a scene."""
    rows = [
        [code(p.name), shown_symbol(p.name), f"{float(p.value):.6g}", p.unit,
         bounds(p.lower, p.upper), plain(p.doc)]
        for p in chosen
    ]  # fmt: skip
    return table(["parameter", "symbol", "default", "unit", "range", "meaning"], rows, "numbers")


def shown_symbol(name: str) -> str:
    """Return the symbol of a parameter as a formula if its name is one."""
    try:
        return f"${symbol(name)}$"
    except ValueError:
        return ""


def bounds(lower: float, upper: float) -> str:
    """Return the range of a parameter."""
    if not isfinite(lower):
        return f"≤ {upper:g}" if isfinite(upper) else "any"
    return f"{lower:g} ... {upper:g}" if isfinite(upper) else f"≥ {lower:g}"


RUBS = BrownMcPhee
"""Law of the pictures, which runs in every scene at any load."""


def scene_pages() -> dict[str, str]:
    """Return the text of each page, by its name relative to `scenes`."""
    text = opening("scenes")
    rows = [
        [f"[{name}]({name}.md)", first_line(kind.__doc__), len(kind(RUBS()).model().x),
         ", ".join(map(code, kind.presets))]
        for name, kind in ALL_SCENES.items()
    ]  # fmt: skip
    text += table(["scene", "description", "states", "presets"], rows) + contents(ALL_SCENES)
    return {name: scene_page(name, kind) for name, kind in ALL_SCENES.items()} | {"index": text}


def scene_page(name: str, kind: type[Scene]) -> str:
    """Return the page of one scene."""
    scene = kind(RUBS())
    model, law = scene.model(), law_name(RUBS())
    rst = f".. autoclass:: symfric.scenes.{kind.__name__}\n"
    about = f"bodies, elements, directions and contacts of {name}"
    caption = "Coordinates, velocities and given forces are blue, inputs green, contacts with "
    caption += f"friction and their loads orange, by `symfric scenes {name} --schematic FILE`"
    picture = f"/made/scenes/{name}_schematic.png"
    text = f"# {name.replace('_', ' ').capitalize()}\n\n"
    text += directive("figure", picture, caption, alt=about, width="24rem")
    text += directive("eval-rst", "", rst)
    text += f"The name on the command line is `{name}`. In Python, use "
    text += f"`from symfric.scenes import {kind.__name__}`.\n\n"
    caption = f"{name} with {law} friction over {kind.t_end:g} s, by "
    caption += code(f"symfric run {name} --law {law}")
    text += directive("figure", f"/made/scenes/{name}.png", caption, alt=f"run of {name}")
    own = [p for p in parameters(scene).values() if p.name not in parameters(scene.law)]
    text += "## Parameters\n\n" + parameter_table(own)
    if kind.presets:
        rows = [[code(n), plain(p.doc), plain(p.source)] for n, p in kind.presets.items()]
        text += f"## Presets\n\n`{kind.__name__}.preset(NAME, law)`, `symfric run {name} --preset "
        text += "NAME`.\n\n" + table(["preset", "description", "source"], rows)
    if places := kind.places():
        rows = [[code(n), plain(doc)] for n, doc in places.items()]
        text += "## Contacts\n\nEach contact may have its own law: `--law-of PLACE=LAW`.\n\n"
        text += table(["place", "description"], rows)
    if model.u:
        given = {u.name: kind.inputs[u.name].text if u.name in kind.inputs else "0"
                 for u in model.u}  # fmt: skip
        rows = [[code(u.name), u.unit, plain(given[u.name]), plain(u.doc)] for u in model.u]
        text += "## Inputs\n\n" + table(["input", "unit", "default", "meaning"], rows)
    rows = [[code(v.name), v.unit, plain(v.doc or "state")] for v in model.x]
    rows += [[code(n), o.unit, plain(o.kind)] for n, o in model.outputs.items()]
    text += "## Signals\n\n" + table(["signal", "unit", "meaning"], rows)
    details = [n for n in model.details() if n not in model.outputs]
    if details:
        more = f" and {len(details) - 60} more" if len(details) > 60 else ""
        names = ", ".join(map(code, details[:60]))
        text += f"Computed on request (`run[name]`) are {names}{more}.\n\n"
    return text


# ---- pictures; matplotlib is imported in the processes that draw ----


def draw_law(name: str, folder: Path) -> None:
    """Draw the picture of `symfric laws NAME --plot`, and a small one of the steady force."""
    import numpy as np  # noqa: PLC0415
    from matplotlib.figure import Figure  # noqa: PLC0415

    from symfric import any_from_text  # noqa: PLC0415
    from symfric.figures.pictures import plot_laws, window  # noqa: PLC0415
    from symfric.laws import steady_force  # noqa: PLC0415

    law = any_from_text(name)
    plot_laws({name: law}, path=folder / f"{name}.png")
    edge = window(law, 1.0)
    v = np.linspace(-edge, edge, 1001)
    figure = Figure(figsize=(2.2, 1.4), layout="constrained")
    axis = figure.add_subplot()
    axis.plot(v, steady_force(law, v, 1.0), linewidth=2)
    axis.axhline(0.0, color="0.7", linewidth=0.8, zorder=0)
    axis.axvline(0.0, color="0.7", linewidth=0.8, zorder=0)
    axis.set(xticks=[], yticks=[])
    figure.savefig(folder / f"{name}_small.png", dpi=110)


def draw_scene(name: str, folder: Path) -> None:
    """Draw the run of a scene, and its schematic."""
    from symfric import simulate  # noqa: PLC0415

    kind = ALL_SCENES[name]
    inputs = {n: given.function for n, given in kind.inputs.items()}
    run = simulate(kind(RUBS()).model(), kind.t_end, u=inputs or None)
    run.plot(path=folder / f"{name}.png")
    kind(RUBS()).schematic(folder / f"{name}_schematic.png")
