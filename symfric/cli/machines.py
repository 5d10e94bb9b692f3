"""A scene as commands name it: its laws, a paper's preset, its parameters."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Annotated

import typer

from symfric import Law, law_from_text, parameters, with_values
from symfric.cli import completions
from symfric.cli.options import assignments
from symfric.foundation.parameters import check_names
from symfric.multibody.urdf.read import relative
from symfric.scenes import ALL_SCENES, Robot, Scene

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
        help="Law of another place of the scene, as hinge=coulomb; may be repeated.",
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
        check_names("--preset of a robot", [preset] if preset else [], ())
        check_names("--law-of of a robot", others, (), "--law is the law of all of its joints")
        return lambda law: Robot(relative(law), scene)
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
    values: dict[str, float],
    preset: str | None = None,
    law_of: Sequence[str] | None = None,
) -> dict[str, Scene]:
    """The scene with each of the laws by name, parameters set wherever they occur.

    Values of --set come after those of a preset.

    Raises:
        ValueError: unknown law, a law given twice, a parameter that none of the scenes has; those
            of `kind_of`.
    """
    if len(set(laws)) != len(laws):
        raise ValueError(f"--law: expected every law once, got {', '.join(laws)}")
    kind = kind_of(scene, preset=preset, law_of=law_of)
    machines = {text: kind(law_from_text(text)) for text in laws}
    known = {text: parameters(machine) for text, machine in machines.items()}
    check_names(f"--set of {scene}", values, {n: None for names in known.values() for n in names})
    return {
        text: with_values(machine, {n: v for n, v in values.items() if n in known[text]})
        for text, machine in machines.items()
    }
