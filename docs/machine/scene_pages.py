"""A page of each scene: equations, picture, parameters, presets, signals."""

from inspect import getdoc
from pathlib import Path
from typing import Any

from docs.machine import rst
from docs.machine.docstrings import first_line, to_rst
from docs.machine.docstrings import text as sentence
from docs.machine.law_pages import number, shown_symbol, signature
from docs.machine.names import linked
from symfric import BrownMcPhee, law_name, parameters
from symfric.scenes import ALL_SCENES, Scene

LAW = BrownMcPhee
"""What rubs in the pictures: runs in every machine, whatever its load."""
NAME = law_name(LAW())


def pages() -> dict[str, str]:
    """Name of each page, relative to `scenes`, -> its text."""
    return {name: page(name, kind) for name, kind in ALL_SCENES.items()} | {"index": index()}


def index() -> str:
    """All scenes in a table."""
    text = rst.title("Scenes")
    text += (
        "Ready machines: each takes any friction law and gives a :py:obj:`Model "
        "<symfric.Model>`. Names are those of ``symfric run SCENE --law NAME``.\n\n"
    )
    rows = []
    for name, kind in ALL_SCENES.items():
        model = kind(LAW()).model()
        presets = ", ".join(f"``{p}``" for p in kind.presets) or "-"
        said = sentence(first_line(kind.__doc__), linked)
        rows.append([f":doc:`{name} <{name}>`", said, str(len(model.x)), presets])
    text += rst.table(["scene", "what it is", "states", "presets"], rows)
    return text + rst.pages((f"{name} <{name}>" for name in ALL_SCENES), hidden="")


def page(name: str, kind: type[Scene]) -> str:
    """One scene in full."""
    scene = kind(LAW())
    model = scene.model()
    doc = getdoc(kind) or ""
    text = rst.title(name.replace("_", " ").capitalize())
    text += f"``{name}`` on the command line, "
    text += f"``from symfric.scenes import {kind.__name__}`` in Python.\n\n"
    text += to_rst(doc, linked, symbols=True)
    if model.sketch is not None:
        about = f"{name} at an instant of this run"
        text += rst.directive("figure", f"/made/scenes/{name}_sketch.png", alt=about, width="24rem")
    said = (
        f"{name} with {NAME} friction over {kind.t_end:g} s, by ``symfric run {name} --law {NAME}``"
    )
    text += rst.directive("figure", f"/made/scenes/{name}.png", said + "\n", alt=f"run of {name}")
    text += rst.title("Parameters", "-") + parameter_table(scene)
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


def parameter_table(scene: Scene) -> str:
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


def draw(name: str, folder: Path) -> None:
    """The run of a scene, and the machine at an instant of it."""
    import numpy as np  # noqa: PLC0415  (in the process that draws)

    from symfric import simulate  # noqa: PLC0415
    from symfric.results.animation import picture  # noqa: PLC0415

    kind = ALL_SCENES[name]
    model = kind(LAW()).model()
    inputs = {n: given.function for n, given in kind.inputs.items()}
    run = simulate(model, kind.t_end, u=inputs or None)
    run.plot(path=folder / f"{name}.png")
    if model.sketch is not None:
        figure, pose = picture(run, np.linspace(0.0, kind.t_end, 40))
        pose(3)  # most machines move then
        figure.savefig(folder / f"{name}_sketch.png", dpi=110)
