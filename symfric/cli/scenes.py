"""`symfric scenes`: what machines there are, and what one of them takes and tells."""

from dataclasses import fields
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
"""The law where none is given: it runs in every scene."""


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
            f"Show the parameters and states of this law, too; pictures are of {LAW}.",
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

    In full: equations, limits, source, inputs with what drives them when nobody says, parameters
    with units and bounds, results, places that take a law of their own, presets of papers, and a
    picture of a run.

    Example: symfric scenes drive

    Example: symfric scenes pendulum_box --law lugre --preset jing_mi_table_7 --plot box.png
    """
    opt.check_outputs(json, picture=plot)
    if name is None:
        check_alone(law, settings, preset, law_of, plot)
        every = {scene: kind(Viscous()) for scene, kind in ALL_SCENES.items()}
        rows = [summary(scene, machine) for scene, machine in every.items()]
        output.emit_json({"scenes": rows}, json)
        if json != "-":
            show_list(rows)
        output.say_written(json)
        return
    text = LAW if law is None else law
    machine = scenes_with(name, [text], opt.assignments("--set", settings), preset, law_of)[text]
    model = machine.model()
    found = to_dict(name, machine, model, text if law else None)
    output.emit_json(found, json)
    if json != "-":
        show_scene(found)
    if plot:
        draw(name, text, machine, model, plot)
    output.say_written(plot, json)


def check_alone(*given: object) -> None:
    """Refuse options that are about one scene where none is named."""
    if any(given):
        raise ValueError(
            "--law, --set, --preset, --law-of, --plot: expected the name of a scene before them, "
            "got none"
        )


def draw(name: str, law: str, machine: Scene, model: Model, path: Path) -> None:
    """A picture of a run with the inputs and the time that show the scene."""
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
    """One line about a scene."""
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
    """The first sentence of the docstring."""
    return " ".join((getdoc(type(machine)) or "").partition("\n\n")[0].split()).removesuffix(".")


def to_dict(name: str, machine: Scene, model: Model, law: str | None) -> dict[str, Any]:
    """Content of `--json` for one scene; parameters and states of laws only with a law."""
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
    """The fields of the scene besides its laws."""
    return {
        item.name: value
        for item in fields(machine)
        if not isinstance(value := getattr(machine, item.name), Law)
    }


def _variable(v: Variable) -> dict[str, Any]:
    start = float(v.start) if is_number(v.start) else None
    return {"name": v.name, "unit": v.unit, "start": start, "doc": v.doc}


def _parameter(p: Parameter) -> dict[str, Any]:
    return {
        "name": p.name,
        "value": float(p.value),
        "unit": p.unit,
        "lower": p.lower,
        "upper": p.upper,
        "doc": p.doc,
    }


def _forms(machine: Scene) -> dict[str, dict[str, str]]:
    """Names that `--set` takes besides numbers, of the scene itself."""
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
    """All scenes, one a line."""
    output.show_table(
        ["scene", "x", "u", "F", "t_end", "what it is"],
        [
            (r["name"], r["states"], len(r["inputs"]), len(r["contacts"]), r["t_end"], r["title"])
            for r in rows
        ],
    )
    papers = [f"  {r['name']}: {', '.join(r['presets'])}" for r in rows if r["presets"]]
    output.show(
        "\nx: states without those of a law; u: inputs; F: contacts with friction; t_end: time [s] "
        "that shows the scene.\n"
        "--preset, numbers of papers:\n" + "\n".join(papers) + "\n"
        "symfric scenes NAME shows equations, parameters, inputs and more;\n"
        "symfric run NAME --law LAW simulates it. Further machines: a robot's FILE.urdf."
    )


def show_scene(found: dict[str, Any]) -> None:
    """Docstring and tables of one scene."""
    output.show_doc(found["doc"])
    output.show(f"{found['name']} is shown over {found['t_end']:g} s.")
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
    """A table and an empty line; nothing where there are no rows."""
    if rows:
        output.show_table(columns, rows, digits=digits)
        output.show()
