"""Scenes from command line options: laws, preset, parameters, inputs and start values."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Annotated, final

import numpy as np

from symfric import Law, Linear, law_from_text, parameters, rate_of, with_values
from symfric.cli import completions
from symfric.cli.options import argument, assignments, numbers, option
from symfric.foundation import checks
from symfric.foundation.parameters import check_names, options
from symfric.foundation.tables import Column, read_table
from symfric.integrator import Input
from symfric.integrator.equations.inputs import Sampled
from symfric.model import Model
from symfric.scenes import ALL_SCENES, Scene

SceneArgument = Annotated[
    str,
    argument(
        "SCENE", f"One of {', '.join(ALL_SCENES)}, or a robot's FILE.urdf.", completions.scenes
    ),
]
LawsOption = Annotated[
    list[str],
    option(
        "--law NAME[,NAME]",
        "Friction law; several, separated by commas or repeated, are compared.",
        completions.each_law,
    ),
]
PresetOption = Annotated[
    str | None,
    option(
        "--preset NAME",
        "Parameters of a paper; `symfric scenes SCENE` lists the presets.",
        completions.presets,
    ),
]
LawOfOption = Annotated[
    list[str] | None,
    option(
        "--law-of PLACE=LAW",
        "Law at another place of the scene or joint of a robot, as hinge=coulomb.",
        completions.places,
    ),
]


def kind_of(
    scene: str, where: str = "scene", preset: str | None = None, law_of: Sequence[str] | None = None
) -> Callable[[Law], Scene]:
    """Return a function law -> scene, for a scene by name or the robot of a URDF file.

    Args:
        scene: name, or FILE.urdf.
        where: name of the argument, for messages.
        preset: value of --preset.
        law_of: texts of --law-of.

    Raises:
        ValueError: unknown scene, preset, place or law.
    """
    others = {place: law_from_text(text) for place, text in assignments("--law-of", law_of).items()}
    if scene.endswith(".urdf"):
        from symfric.multibody.urdf import relative  # noqa: PLC0415  (for robots only)
        from symfric.scenes import Robot  # noqa: PLC0415

        check_names("--preset of a robot", [preset] if preset else [], ())
        laws = tuple(relative(law) for law in others.values())
        return lambda law: Robot(relative(law), scene, tuple(others), laws)
    check_names(where, [scene], ALL_SCENES)
    kind = ALL_SCENES[scene]
    check_names(
        f"--law-of of {scene}", others, kind.places(), "--law is the law of the main contact"
    )
    if preset is not None:
        check_names(f"--preset of {scene}", [preset], kind.presets)
        return partial(kind.preset, preset, **others)
    return partial(kind, **others) if others else kind


def scenes_with(
    scene: str,
    laws: Sequence[str],
    settings: Mapping[str, str | float],
    preset: str | None = None,
    law_of: Sequence[str] | None = None,
) -> dict[str, Scene]:
    """Return the scene with each of the laws, by name of the law.

    Args:
        scene: name, or FILE.urdf.
        laws: texts of --law.
        settings: values of --set: parameters of scene and laws, forms of laws, structure of the
            scene; they override a preset.
        preset: value of --preset.
        law_of: texts of --law-of.

    Raises:
        ValueError: unknown law, a parameter that none of the scenes has; see also `kind_of`.
    """
    kind = kind_of(scene, preset=preset, law_of=law_of)
    made = {text: law_from_text(text) for text in laws}
    machines = {text: formed(kind(law), settings) for text, law in made.items()}
    known = {text: parameters(machine) for text, machine in machines.items()}
    made_of = {text: forms(machine) for text, machine in machines.items()}
    every = {n: None for group in (known, made_of) for names in group.values() for n in names}
    check_names(f"--set of {scene}", settings, every)
    values = {
        name: _number(name, text)
        for name, text in settings.items()
        if any(name in names for names in known.values())
    }
    return {
        text: with_values(machine, {n: v for n, v in values.items() if n in known[text]})
        for text, machine in machines.items()
    }


def formed(machine: Scene, settings: Mapping[str, str | float]) -> Scene:
    """Return the scene with the forms and the structure in `settings`.

    Raises:
        ValueError: a text that is not one of the choices, a count, or true or false.
    """
    law = {n: str(text) for n, text in settings.items() if n in options(machine.law)}
    if law:
        machine = replace(machine, law=replace(machine.law, **law))
    own = {n: settings[n] for n in (*options(machine), *machine.structures()) if n in settings}
    chosen = {name: _chosen(name, text, getattr(machine, name)) for name, text in own.items()}
    return replace(machine, **chosen) if chosen else machine


def forms(machine: Scene) -> list[str]:
    """Return the names of a scene that --set accepts besides parameters."""
    return [*options(machine.law), *options(machine), *machine.structures()]


def _number(name: str, given: str | float) -> float:
    return checks.parsed(f"--set {name}", given) if isinstance(given, str) else given


def _chosen(name: str, text: str | float, like: str | bool | int) -> str | bool | int:
    """Convert a text to the type of `like`."""
    if isinstance(like, str):
        return str(text)
    if isinstance(like, bool):
        return checks.choice(f"--set {name}", text, ("true", "false")) == "true"
    number = _number(name, text)
    return int(number) if number.is_integer() else checks.count(f"--set {name}", number)


@final
@dataclass(frozen=True, eq=False)
class Driven:
    """Inputs, start values and end time of a run.

    Attributes:
        signals: inputs by name.
        texts: inputs as written on the command line.
        start: state -> value.
        until: end time [s].
    """

    signals: dict[str, Input]
    texts: dict[str, str]
    start: dict[str, float]
    until: float


def driven(
    scene: Scene,
    model: Model,
    texts: Sequence[str] | None,
    x0: Sequence[str] | None,
    t_end: float | None,
) -> Driven:
    """Convert the texts of --input, --x0 and --t-end for a scene.

    Inputs that are not given are those of the scene. The default end time is that of the samples,
    or that of the scene. Samples of a state whose rate is an input (`Scene.integrals`) determine
    that input and the start value of the state.

    Raises:
        ValueError: unknown names, an input together with its integral; see also `input_from_text`.
    """
    given, units = assignments("--input", texts), {v.name: v.unit for v in model.u}
    rates = {state: rate for state, rate in scene.integrals.items() if rate in units}
    units |= {v.name: v.unit for v in model.x if v.name in rates}
    check_names(f"--input of {model.name}", given, units)
    signals: dict[str, Input] = {}
    written, start = dict(given), dict[str, float]()
    for name, text in given.items():
        signal = input_from_text(name, text, units[name])
        if name not in rates:
            signals[name] = signal
            continue
        if rates[name] in given:
            raise ValueError(f"--input: expected {name} or its rate {rates[name]}, got both")
        signals[rates[name]] = rate_of(signal)
        start[name] = float(np.asarray(signal.values)[0] if isinstance(signal, Linear) else signal)  # type: ignore[arg-type]
    for name, own in scene.inputs.items():
        if name not in signals:
            signals[name], written[name] = own.function, own.text
    ends = [float(np.max(s.t)) for s in signals.values() if isinstance(s, Sampled)]
    until = max(ends, default=scene.t_end) if t_end is None else t_end
    return Driven(signals, written, start | numbers("--x0", x0), until)


def input_from_text(name: str, text: str, unit: str) -> Linear | float:
    """Return the input `2.0`, or `FILE.csv:COLUMN` interpolated linearly over time.

    Args:
        name: name of the input.
        text: text after the equals sign.
        unit: SI unit of the input.

    Raises:
        ValueError: neither a finite number nor a column of a readable file.
    """
    try:
        value = float(text)
    except ValueError:
        file, colon, column = text.rpartition(":")
        if not colon or not file or not column:
            raise ValueError(
                f"--input {name}: expected a number or FILE.csv:COLUMN, got '{text}'"
            ) from None
        return read_column(Path(file), column, unit)
    return checks.number(f"--input {name}", value)


def read_column(path: Path, column: str, unit: str) -> Linear:
    """Read the samples of `column` over the column t of a CSV file.

    Units in the header are converted to SI, as in `symfric identify`; columns without a unit are in
    SI.

    Raises:
        ValueError: missing or repeated column, no column t, incompatible unit, a row without
            numbers, or times that do not increase.
        OSError: the file cannot be read.
    """
    names = (column, column.partition("[")[0].strip())
    table = read_table(
        path,
        {
            "t": Column(("t", "time", "Time"), "s", assumed=True),
            column: Column(names, unit, assumed=True),
        },
    )
    try:
        return Linear(table.columns["t"], table.columns[column])
    except ValueError as error:
        raise ValueError(f"read '{path.name}': {error}") from None
