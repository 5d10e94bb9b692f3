"""`symfric scenes`: list the scenes, or show one in full."""

from dataclasses import fields
from functools import partial
from inspect import getdoc
from pathlib import Path
from typing import Annotated, Any

from symfric import Law, SolveError, Trajectory, Viscous, parameters, simulate
from symfric.cli import completions, output
from symfric.cli import options as opt
from symfric.cli.machines import LawOfOption, PresetOption, driven, scenes_with
from symfric.cli.options import argument, option
from symfric.foundation.numeric import is_number
from symfric.foundation.parameters import Parameter, Variable, options
from symfric.model import Model
from symfric.scenes import ALL_SCENES, Scene

LAW = "brown_mcphee"
"""Default law, which runs in every scene."""


def scenes(
    name: Annotated[
        str | None,
        argument(
            "NAME|FILE.urdf",
            "One scene, such as drive, or a robot's FILE.urdf.",
            completions.scenes,
        ),
    ] = None,
    law: Annotated[
        str | None,
        option(
            "--law NAME",
            f"Include parameters and states of this law; default for pictures: {LAW}.",
            completions.laws,
        ),
    ] = None,
    settings: opt.SetOption = None,
    preset: PresetOption = None,
    law_of: LawOfOption = None,
    plot: opt.PlotOption = None,
    json: opt.JsonOption = None,
) -> None:
    """List the scenes, or show one in full.

    In full: equations, limits, source, inputs with defaults, parameters with units and bounds,
    results, places that accept a law of their own, presets of papers, and a picture of a run.

    Example: symfric scenes drive

    Example: symfric scenes pendulum_box --law lugre --preset jing_mi_table_7 --plot box.png
    """
    opt.check_outputs(json, picture=plot)
    if name is None:
        check_alone(law, settings, preset, law_of, plot)
        every = {scene: kind(Viscous()) for scene, kind in ALL_SCENES.items()}
        rows = [summary(scene, machine) for scene, machine in every.items()]
        return output.finish({"scenes": rows}, json, partial(show_list, rows))
    text = LAW if law is None else law
    machine = scenes_with(name, [text], opt.assignments("--set", settings), preset, law_of)[text]
    model = machine.model()
    found = to_dict(name, machine, model, text if law else None)
    if plot:
        draw(name, text, machine, model, plot)
    return output.finish(found, json, partial(show_scene, found), plot)


def check_alone(*given: object) -> None:
    """Refuse options for a single scene if no scene is named."""
    if any(given):
        raise ValueError(
            "--law, --set, --preset, --law-of, --plot: expected the name of a scene before them, "
            "got none"
        )


def draw(name: str, law: str, machine: Scene, model: Model, path: Path) -> None:
    """Draw a run with the default inputs and end time of the scene."""
    from symfric.results.pictures import plot_trajectories  # noqa: PLC0415  (matplotlib is slow)

    given = driven(machine, model, None, None, None)
    with output.progress(f"{name} with {law}") as tell:
        run: Trajectory = simulate(
            model, given.until, x0=given.start, u=given.signals, throw=False, progress=tell
        )
    plot_trajectories({law: run}, path=path)
    if not run.status.ok:
        raise SolveError(run.message, run.status, run)


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
    """Return the first sentence of the docstring."""
    return " ".join((getdoc(type(machine)) or "").partition("\n\n")[0].split()).removesuffix(".")


def to_dict(name: str, machine: Scene, model: Model, law: str | None) -> dict[str, Any]:
    """Return the content of `--json`; parameters and states of laws only if `law` is given."""
    whole = type(machine)(Viscous(), **_without_laws(machine)).model() if law is None else model
    own = {item.name for item in fields(machine)}
    known = {n: p for n, p in parameters(machine).items() if law is not None or n in own}
    return {
        "name": name,
        "title": title(machine),
        "doc": getdoc(type(machine)) or "",
        "python": type(machine).__name__ if name in ALL_SCENES else None,
        "law": law,
        "t_end": machine.t_end,
        "states": [_variable(v) for v in whole.x],
        "inputs": [
            {**_variable(u), "given": machine.inputs[u.name].text}
            if u.name in machine.inputs
            else _variable(u)
            for u in model.u
        ],
        "integrals": dict(machine.integrals),
        "parameters": [_parameter(p) for p in known.values()],
        "forms": _forms(machine),
        "places": machine.places(),
        "contacts": [c.name for c in model.contacts],
        "outputs": {n: {"unit": o.unit, "doc": o.doc} for n, o in whole.outputs.items()},
        "presets": {n: {"doc": p.doc, "source": p.source} for n, p in machine.presets.items()},
    }


def _without_laws(machine: Scene) -> dict[str, Any]:
    """Return the fields of the scene except its laws."""
    return {
        item.name: value
        for item in fields(machine)
        if not isinstance(value := getattr(machine, item.name), Law)
    }


def _variable(v: Variable) -> dict[str, Any]:
    start = float(v.start) if is_number(v.start) else None
    return {"name": v.name, "unit": v.unit, "start": start, "doc": v.doc}


def _parameter(p: Parameter) -> dict[str, Any]:
    found = {n: getattr(p, n) for n in ("name", "unit", "lower", "upper", "doc")}
    return found | {"value": float(p.value)}


def _forms(machine: Scene) -> dict[str, dict[str, str]]:
    """Return the names of the scene that `--set` accepts besides parameters."""
    named = {
        o.name: {"value": o.value, "choices": ", ".join(o.choices), "doc": o.doc}
        for o in options(machine).values()
    }
    return named | {
        name: {
            "value": str(value).lower(),
            "choices": "true, false" if isinstance(value, bool) else "a count",
            "doc": doc,
        }
        for name, doc in machine.structures().items()
        for value in [getattr(machine, name)]
    }


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
    output.show(
        "\nx: states without those of the law; u: inputs; F: contacts with friction; t_end: "
        "default end time [s].\n"
        "--preset, parameters of papers:\n" + "\n".join(papers) + "\n"
        "symfric scenes NAME shows equations, parameters, inputs and more;\n"
        "symfric run NAME --law LAW simulates it. Other machines: FILE.urdf of a robot."
    )


def show_scene(found: dict[str, Any]) -> None:
    """Print docstring and tables of one scene."""
    output.show_doc(found["doc"])
    output.show(f"Default end time: {found['t_end']:g} s.")
    if found["python"]:
        output.show(f"In Python: from symfric.scenes import {found['python']}")
    output.show()
    _table(
        ["state", "start", "unit", "meaning"],
        [(v["name"], _number(v["start"]), v["unit"], v["doc"]) for v in found["states"]],
    )
    _table(
        ["input", "unit", "when not given", "meaning"],
        [
            (v["name"], v["unit"], v.get("given", _number(v["start"])), v["doc"])
            for v in found["inputs"]
        ],
    )
    for state, rate in found["integrals"].items():
        output.show(f"--input {state}=FILE.csv:COLUMN gives {rate} as the rate of {state}.\n")
    _table(
        ["parameter", "value", "unit", "lower", "upper", "meaning"],
        [
            (p["name"], p["value"], p["unit"], p["lower"], p["upper"], p["doc"])
            for p in found["parameters"]
        ],
        output.EXACT,
    )
    _table(
        ["--set", "value", "choices", "meaning"],
        [(n, f["value"], f["choices"], f["doc"]) for n, f in found["forms"].items()],
    )
    _table(["--law-of", "place"], [*found["places"].items()])
    _table(
        ["result", "unit", "meaning"],
        [(name, o["unit"], o["doc"]) for name, o in found["outputs"].items()],
    )
    _table(
        ["--preset", "numbers", "source"],
        [(name, p["doc"], p["source"]) for name, p in found["presets"].items()],
    )
    if found["law"] is None:
        output.show("--law NAME shows the parameters of a law in it, too.")


def _number(value: float | None) -> str:
    return "of the law" if value is None else output.number(value)


def _table(columns: list[str], rows: list[Any], digits: int = 6) -> None:
    """Print a table and an empty line; nothing if there are no rows."""
    if rows:
        output.show_table(columns, rows, digits=digits)
        output.show()
