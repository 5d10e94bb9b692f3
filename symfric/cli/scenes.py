"""`symfric scenes`: list the scenes, or show one in full."""

from dataclasses import fields
from functools import partial
from inspect import getdoc
from math import isnan
from pathlib import Path
from typing import Any

from symfric import Law, Viscous, parameters, simulate
from symfric.cli import options as opt
from symfric.cli import output
from symfric.cli.app import TEXTS
from symfric.cli.machines import OwnMachine, driven, scenes_with
from symfric.cli.options import Strings
from symfric.cli.run import refuse_failed, simulated
from symfric.foundation.numeric import is_number
from symfric.foundation.parameters import Variable, options
from symfric.model import Model
from symfric.scenes import ALL_SCENES, Scene

LAW = "brown_mcphee"
"""Default law, which is suitable for every scene."""


def scenes(
    name: str | None = None,
    law: str | None = None,
    settings: Strings = None,
    preset: str | None = None,
    law_of: Strings = None,
    plot: Path | None = None,
    schematic: Path | None = None,
    json: str | None = None,
) -> None:
    """List the scenes, or show one in full.

    A scene in full has equations, limits, source, inputs with defaults, parameters with units and
    bounds, results, contacts that accept a separate law, presets of papers, a picture of a run, and
    a labelled schematic.

    Example: symfric scenes drive

    Example: symfric scenes drive --schematic drive.png

    Example: symfric scenes pendulum_box --law lugre --preset jing_mi_table_7 --plot box.png
    """
    opt.check_outputs(json, picture=plot)
    opt.check_outputs(picture=schematic)
    if name is None:
        if any((law, settings, preset, law_of, plot, schematic)):
            raise ValueError(
                "--law, --set, --preset, --law-of, --plot, --schematic: expected the name of a "
                "scene before them, got none"
            )
        rows = [summary(scene, kind(Viscous())) for scene, kind in ALL_SCENES.items()]
        return output.finish({"scenes": rows}, json, partial(show_list, rows))
    text = LAW if law is None else law
    machine = scenes_with(name, {text: opt.named_law(text)}, settings, preset, law_of)[text]
    model = machine.model()
    found = to_dict(name, machine, model, law)
    if plot:
        from symfric.results.pictures import plot_trajectories  # noqa: PLC0415  (slow to import)

        given = driven(machine, model)
        how: dict[str, Any] = {"x0": given.start, "u": given.signals, "throw": False}
        run = simulated(
            name,
            {text: model},
            lambda model, tell: simulate(model, given.until, progress=tell, **how),
        )
        plot_trajectories(run, path=plot)
        refuse_failed(run.values())
    files = (plot, None), (schematic, machine.schematic)
    return output.finish(found, json, partial(show_scene, found), *files)


def summary(name: str, machine: Scene) -> dict[str, Any]:
    """Return the entry of a scene in the list."""
    model = machine.model()
    return {
        "name": name,
        "title": title(machine),
        "states": len(model.x),
        "inputs": [u.name for u in model.u],
        "contacts": [c.name for c in model.contacts],
        "t_end": machine.t_end,
        "presets": [*machine.presets],
    }


def title(machine: Scene) -> str:
    """Return the first sentence of the docstring of a scene."""
    return " ".join((getdoc(type(machine)) or "").partition("\n\n")[0].split()).removesuffix(".")


def to_dict(name: str, machine: Scene, model: Model, law: str | None) -> dict[str, Any]:
    """Return the content of `--json`; parameters and states of laws only if `law` is given."""
    values = {item.name: getattr(machine, item.name) for item in fields(machine)}
    whole = model
    if law is None:
        own = {n: value for n, value in values.items() if not isinstance(value, Law)}
        whole = type(machine)(Viscous(), **own).model()
    inputs = [
        _variable(u) | ({"given": machine.inputs[u.name].text} if u.name in machine.inputs else {})
        for u in model.u
    ]
    shown = ("name", "unit", "lower", "upper", "doc")
    return {
        "name": name,
        "title": title(machine),
        "doc": getdoc(machine.make if isinstance(machine, OwnMachine) else type(machine)) or "",
        "python": type(machine).__name__ if name in ALL_SCENES else None,
        "law": law,
        "t_end": None if isnan(machine.t_end) else machine.t_end,
        "states": [_variable(v) for v in whole.x],
        "inputs": inputs,
        "integrals": dict(machine.integrals),
        "parameters": [
            {key: getattr(p, key) for key in shown} | {"value": float(p.value)}
            for n, p in parameters(machine).items()
            if law is not None or n in values
        ],
        "forms": _forms(machine),
        "places": machine.places(),
        "contacts": [c.name for c in model.contacts],
        "outputs": {n: {"unit": o.unit, "doc": o.doc} for n, o in whole.outputs.items()},
        "presets": {n: {"doc": p.doc, "source": p.source} for n, p in machine.presets.items()},
    }


def _variable(v: Variable) -> dict[str, Any]:
    start = float(v.start) if is_number(v.start) else None
    return {"name": v.name, "unit": v.unit, "start": start, "doc": v.doc}


def _forms(machine: Scene) -> dict[str, dict[str, str]]:
    """Return the names of the scene that `--set` accepts in addition to parameters."""
    found = {
        o.name: {"value": o.value, "choices": ", ".join(o.choices), "doc": o.doc}
        for o in options(machine).values()
    }
    for name, doc in machine.structures().items():
        value = getattr(machine, name)
        choices = "true, false" if isinstance(value, bool) else "a count"
        found[name] = {"value": str(value).lower(), "choices": choices, "doc": doc}
    return found


def show_list(rows: list[dict[str, Any]]) -> None:
    """Print all scenes, one per line."""
    output.show_table(
        ["scene", "x", "u", "F", "t_end", "description"],
        [
            (r["name"], r["states"], len(r["inputs"]), len(r["contacts"]), r["t_end"], r["title"])
            for r in rows
        ],
    )
    papers = [f"  {r['name']}: {', '.join(r['presets'])}" for r in rows if r["presets"]]
    output.show(TEXTS["legends"]["scenes"].format(papers="\n".join(papers)))


TABLES = {
    "states": {"state": "name", "start": "start", "unit": "unit", "meaning": "doc"},
    "inputs": {"input": "name", "unit": "unit", "when not given": "start", "meaning": "doc"},
    "parameters": {
        "parameter": "name", "value": "value", "unit": "unit", "lower": "lower", "upper": "upper",
        "meaning": "doc",
    },
    "forms": {"--set": "name", "value": "value", "choices": "choices", "meaning": "doc"},
    "places": {"--law-of": "name", "place": "doc"},
    "outputs": {"result": "name", "unit": "unit", "meaning": "doc"},
    "presets": {"--preset": "name", "numbers": "doc", "source": "source"},
}  # fmt: skip
"""Tables of a scene: part of the JSON -> column -> key of the entries."""


def show_scene(found: dict[str, Any]) -> None:
    """Print the docstring and the tables of one scene."""
    output.show_doc(found["doc"])
    if found["t_end"] is not None:
        output.show(f"Default end time: {found['t_end']:g} s.")
    if found["python"]:
        output.show(f"In Python: from symfric.scenes import {found['python']}")
    output.show()
    for part, columns in TABLES.items():
        entries = found[part]
        if isinstance(entries, dict):
            every = [(n, v if isinstance(v, dict) else {"doc": v}) for n, v in entries.items()]
            entries = [{"name": n, **values} for n, values in every]
        rows = [[_cell(entry, key) for key in columns.values()] for entry in entries]
        output.show_part([*columns], rows, output.EXACT if part == "parameters" else 6)
        for state, rate in found["integrals"].items() if part == "inputs" else ():
            output.show(f"--input {state}=FILE.csv:COLUMN gives {rate} as the rate of {state}.\n")
    if found["law"] is None:
        output.show("--law NAME also shows the parameters of a law in it.")


def _cell(entry: dict[str, Any], key: str) -> Any:
    """Return a cell of a table; start values are texts."""
    value = entry.get("given", entry[key]) if key == "start" else entry[key]
    if key != "start" or isinstance(value, str):
        return value
    return "of the law" if value is None else output.number(value)
