"""A scene as commands name it: its laws, a paper's preset, its parameters."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Annotated

import typer

from symfric import Law, law_from_text, parameters, with_values
from symfric.cli import completions
from symfric.cli.options import assignments
from symfric.foundation import checks
from symfric.foundation.parameters import check_names, options
from symfric.scenes import ALL_SCENES, Scene

SceneArgument = Annotated[
    str,
    typer.Argument(
        metavar="SCENE",
        help=f"One of {', '.join(ALL_SCENES)}, or a robot's FILE.urdf.",
        autocompletion=completions.scenes,
    ),
]
LawsOption = Annotated[
    list[str],
    typer.Option(
        "--law",
        metavar="NAME[,NAME]",
        help="Friction law; several, with commas or repeated, are compared.",
        autocompletion=completions.each_law,
    ),
]
PresetOption = Annotated[
    str | None,
    typer.Option(
        "--preset",
        metavar="NAME",
        help="Numbers of a paper; `symfric scenes SCENE` lists them.",
        autocompletion=completions.presets,
    ),
]
LawOfOption = Annotated[
    list[str] | None,
    typer.Option(
        "--law-of",
        metavar="PLACE=LAW",
        help="Law of another place of the scene or joint of a robot, as hinge=coulomb.",
        autocompletion=completions.places,
    ),
]


def kind_of(
    scene: str, where: str = "scene", preset: str | None = None, law_of: Sequence[str] | None = None
) -> Callable[[Law], Scene]:
    """What makes the scene of a law: a scene by its name, or the robot of a URDF file.

    Args:
        scene: its name, or FILE.urdf.
        where: the argument it stands in.
        preset: of --preset.
        law_of: texts of --law-of.

    Raises:
        ValueError: neither; no such preset, place or law.
    """
    others = {place: law_from_text(text) for place, text in assignments("--law-of", law_of).items()}
    if scene.endswith(".urdf"):
        from symfric.multibody.urdf.read import relative  # noqa: PLC0415  (of robots only)
        from symfric.scenes import Robot  # noqa: PLC0415

        check_names("--preset of a robot", [preset] if preset else [], ())
        laws = tuple(relative(law) for law in others.values())
        return lambda law: Robot(relative(law), scene, tuple(others), laws)
    check_names(where, [scene], ALL_SCENES)
    kind = ALL_SCENES[scene]
    check_names(
        f"--law-of of {scene}", others, kind.places(), "--law is the law of what rubs there"
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
    """The scene with each of the laws by name, parameters set wherever they occur.

    Args:
        scene: its name, or FILE.urdf.
        laws: texts of --law.
        settings: of --set: numbers of scene and laws, forms of laws, what the scene is made of;
            they come after those of a preset.
        preset, law_of: of these options.

    Raises:
        ValueError: unknown law, a parameter that none of the scenes has; those of `kind_of`.
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
    """The scene with the forms and the structure among texts of --set.

    Raises:
        ValueError: a text that is none of the choices, no count, neither true nor false.
    """
    law = {n: str(text) for n, text in settings.items() if n in options(machine.law)}
    if law:
        machine = replace(machine, law=replace(machine.law, **law))
    own = {n: settings[n] for n in (*options(machine), *machine.structures()) if n in settings}
    chosen = {name: _chosen(name, text, getattr(machine, name)) for name, text in own.items()}
    return replace(machine, **chosen) if chosen else machine


def forms(machine: Scene) -> list[str]:
    """What --set takes of a scene besides numbers."""
    return [*options(machine.law), *options(machine), *machine.structures()]


def _number(name: str, given: str | float) -> float:
    return checks.parsed(f"--set {name}", given) if isinstance(given, str) else given


def _chosen(name: str, text: str | float, like: str | bool | int) -> str | bool | int:
    """What a text means for a field that holds a value of the kind of `like`."""
    if isinstance(like, str):
        return str(text)
    if isinstance(like, bool):
        return checks.choice(f"--set {name}", text, ("true", "false")) == "true"
    number = _number(name, text)
    return int(number) if number.is_integer() else checks.count(f"--set {name}", number)
