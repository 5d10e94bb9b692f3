"""`symfric codegen`: a friction law, or a scene as a plant, as C99, verified on this machine."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any, final

import typer

from symfric import Law, any_from_text, law_from_text, with_values
from symfric.cli import completions, output
from symfric.cli.codegen_compensator import compensator_block
from symfric.cli.codegen_robot import robot_block
from symfric.cli.codegen_shown import show_sizes, show_verification
from symfric.cli.machines import LawOfOption, PresetOption, formed, forms, kind_of
from symfric.cli.options import (
    JsonOption,
    SetOption,
    assignments,
    check_folder,
    check_outputs,
    numbers,
    with_settings,
)
from symfric.codegen import Block, Generated, Verification, generate, plant_block, verify
from symfric.codegen.kit.generate import with_cores
from symfric.embedded import CORES, Measured, measure
from symfric.foundation import checks
from symfric.foundation.compiler import find_compiler
from symfric.foundation.parameters import check_names, parameters
from symfric.foundation.status import Status
from symfric.laws import AnyLaw
from symfric.scenes import Drive, Scene

REALS = {"double": ("double",), "float": ("float",), "both": ("double", "float")}


def codegen(
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the files.")],
    fit: Annotated[
        Path | None,
        typer.Argument(
            metavar="[FIT.json]",
            help="What `symfric identify --json` wrote; ROBOT.urdf with --inverse-dynamics.",
        ),
    ] = None,
    law: Annotated[
        str | None,
        typer.Option(
            "--law",
            metavar="NAME",
            help="Friction law, such as lugre; or FIT.json.",
            autocompletion=completions.laws,
        ),
    ] = None,
    settings: SetOption = None,
    preset: PresetOption = None,
    law_of: LawOfOption = None,
    scene: Annotated[
        str | None,
        typer.Option(
            "--scene",
            metavar="NAME",
            help="The plant of this scene, or FILE.urdf, with the law.",
            autocompletion=completions.scenes,
        ),
    ] = None,
    method: Annotated[
        str | None,
        typer.Option(
            "--method",
            help="How a plant advances; default rodas3, of mechanisms with friction "
            "backward_euler.",
        ),
    ] = None,
    real: Annotated[
        str | None,
        typer.Option("--real", help="double, float or both; default both, double for a plant."),
    ] = None,
    step_size: Annotated[
        float | None,
        typer.Option("--step-size", help="Step [s] as a constant, for laws with states, plants."),
    ] = None,
    name: Annotated[
        str | None, typer.Option("--name", help="C identifier; default from the law.")
    ] = None,
    fold: Annotated[
        bool,
        typer.Option("--fold", help="Bake all parameters in; without it all can be changed."),
    ] = False,
    free: Annotated[
        list[str] | None,
        typer.Option("--free", metavar="NAME", help="Keep this one variable, bake the others in."),
    ] = None,
    guards: Annotated[
        bool,
        typer.Option("--guards/--no-guards", help="Clamp, repair and report what cannot be."),
    ] = True,
    kit: Annotated[
        bool,
        typer.Option(
            "--kit/--no-kit",
            help="Unit test, CMake, Python and Simulink files beside the sources.",
        ),
    ] = True,
    core: Annotated[
        list[str] | None,
        typer.Option(
            "--core", metavar="NAME", help=f"Measure it on this core, too: {', '.join(CORES)}."
        ),
    ] = None,
    turning: Annotated[
        bool, typer.Option("--turning", help="A law in rad/s and N m: units in the header.")
    ] = False,
    inverse_dynamics: Annotated[
        bool,
        typer.Option(
            "--inverse-dynamics",
            help="Forces of the joints that a motion needs, of ROBOT.urdf or --scene, with the "
            "friction of --law or of the file.",
        ),
    ] = False,
    payload: Annotated[
        str | None,
        typer.Option(
            "--payload", metavar="FRAME", help="Link or frame that carries a load, set at run time."
        ),
    ] = None,
    tunable_gravity: Annotated[
        bool, typer.Option("--tunable-gravity", help="Gravity is set at run time.")
    ] = False,
    compensator: Annotated[
        bool,
        typer.Option("--compensator", help="A friction compensator of the law, or of a fit."),
    ] = False,
    compensation: Annotated[
        list[str] | None,
        typer.Option(
            "--compensation",
            metavar="NAME=VALUE",
            help="What it does, such as v_blend=0.02, scales=coulomb:0.9,stribeck:0, limit=5.",
        ),
    ] = None,
    compiler: Annotated[
        str | None, typer.Option("--compiler", help="Default: $CC, gcc or clang.")
    ] = None,
    json: JsonOption = None,
) -> None:
    """Write a friction law, a plant or inverse dynamics as C99, and verify it.

    The C is compiled and compared with CasADi over more than 20 000 steps, bad inputs and other
    parameters among them. The exit status is 1 where it could not be verified, as without a
    compiler, or differs; the files are written all the same.
    The law of a fit has the fitted numbers, and so has its drive with `--scene drive`.

    Example: symfric codegen --law lugre --out build --step-size 0.001

    Example: symfric codegen robot.urdf --inverse-dynamics --payload tool0 --out build

    Example: symfric codegen fit.json --compensator --compensation v_blend=0.02 --out build
    """
    check_names("--core", core or (), CORES)
    check_folder(out)
    check_outputs(json)
    if compiler is not None:
        find_compiler(checks.text("--compiler", compiler, "a C compiler"))
    chosen = None if inverse_dynamics else chosen_law(fit, law)
    subject = subject_of(chosen, scene, compensator)
    kind = real
    if kind is None:
        kind = "double" if subject == PLANT else "both"
    check_names("--real", [kind], REALS)
    given = {
        "--step-size": step_size is not None, "--method": method is not None, "--free": bool(free),
        "--fold": fold, "--turning": turning, "--payload": payload is not None,
        "--tunable-gravity": tunable_gravity, "--compensation": bool(compensation),
        "--preset": preset is not None, "--law-of": bool(law_of),
    }  # fmt: skip
    check_applicable(subject, [option for option, there in given.items() if there])
    own: dict[str, Any] = {"fold": fold or None, "free": free or None, "name": name, "h": step_size}
    own = {option: value for option, value in own.items() if value is not None}
    adjustable, forces = None, ()
    if chosen is None:
        values = numbers("--set", settings)
        made: Block | AnyLaw = robot_block(
            fit, scene, law, values,
            name=name, h=step_size, fold=fold, payload=payload, tunable_gravity=tunable_gravity,
        )  # fmt: skip
        text, own = law or made.name, {}
    elif scene is not None:
        kind_of_scene = kind_of(scene, "--scene", preset, law_of)
        machine = machine_of(scene, kind_of_scene, chosen, assignments("--set", settings))
        own["method"] = "auto" if method is None else method
        made = plant_block(machine, **own)
        adjustable = partial(plant_block, machine, **{n: v for n, v in own.items() if n != "h"})
        text, own = chosen.text, {}
    elif compensator:
        compensated = with_settings(chosen.law, chosen.text, settings)
        made = compensator_block(
            compensated, chosen.drive, compensation or (),
            name=name, h=step_size, turning=turning, fold=fold,
        )  # fmt: skip
        text, own = chosen.text, {}
    else:
        made = with_settings(chosen.law, chosen.text, settings)
        if turning or chosen.turning:
            own["turning"] = True
        text, forces = chosen.text, chosen.forces
    generated = generate(made, out, real=REALS[kind], guards=guards, kit=kit, **own)
    verification = verify(generated, compiler=compiler, adjustable=adjustable)
    if forces:
        names = ", ".join(forces)
        output.note(f"{names}: forces, fitted under a load of 1 N; call the C with N = 1")
    measured = on_cores(generated, core or ())
    generated = with_cores(generated, [m.to_dict() for m in measured])
    _proved(text, generated, verification, measured, json)


LAW, FUNCTION, POPULATION = "a law", "a law without states", "a population"
PLANT, INVERSE, COMPENSATOR = "--scene", "--inverse-dynamics", "--compensator"

APPLIES = {
    "--step-size": (LAW, POPULATION, PLANT, INVERSE, COMPENSATOR),
    "--method": (PLANT,),
    "--free": (LAW, FUNCTION, PLANT),
    "--fold": (LAW, FUNCTION, PLANT, INVERSE, COMPENSATOR),
    "--turning": (LAW, FUNCTION, COMPENSATOR),
    "--payload": (INVERSE,),
    "--tunable-gravity": (INVERSE,),
    "--compensation": (COMPENSATOR,),
    "--preset": (PLANT,),
    "--law-of": (PLANT,),
}
"""Options that do not fit all that C is made of, and what they fit."""

WHY = {
    "--step-size": "which has no step",
    "--method": "whose step is exact, or the best that is known",
    "--turning": "which knows what turns",
}


def subject_of(chosen: "Chosen | None", scene: str | None, compensator: bool) -> str:
    """What C is made of.

    Raises:
        ValueError: a compensator of a scene or of inverse dynamics.
    """
    if compensator and (chosen is None or scene is not None):
        other = INVERSE if chosen is None else PLANT
        raise ValueError(f"codegen: {COMPENSATOR}: expected with a law or a fit, got {other}")
    if compensator:
        return COMPENSATOR
    if chosen is None:
        return INVERSE
    if scene is not None:
        return PLANT
    if not isinstance(chosen.law, Law):
        return POPULATION
    return LAW if chosen.law.states else FUNCTION


def check_applicable(subject: str, given: list[str]) -> None:
    """Refuse options that say nothing to what is asked for, all at once."""
    problems: list[str] = []
    for option in given:
        fits = [s for s in APPLIES[option] if s != FUNCTION]
        if subject not in APPLIES[option]:
            why = f", {WHY[option]}" if option in WHY and subject != INVERSE else ""
            problems.append(f"{option}: expected with {' or '.join(fits)} only, got {subject}{why}")
    if {"--free", "--fold"} <= set(given):
        problems.append("--free, --fold: expected one of them, got both; --free folds the others")
    if problems:
        raise ValueError("codegen: " + "; ".join(problems))


def _proved(
    text: str,
    generated: Generated,
    verification: Verification,
    measured: list[Measured],
    json: str | None,
) -> None:
    """Say what was written and whether it was verified; the exit status says it, too."""
    output.emit_json(to_dict(text, generated, verification, measured), json)
    if json != "-":
        show_verification(verification)
        show_sizes(generated, measured)
    output.say_folder(generated.folder, generated.files)
    output.say_written(json)
    if not verification.ok:
        raise typer.Exit(1)


def on_cores(generated: Generated, cores: Sequence[str]) -> list[Measured]:
    """The block on Cortex-M cores, in every type that was generated."""
    return [
        measure(generated.block, real, core, guards=generated.guards)
        for core in cores
        for real in generated.reals
    ]


@final
@dataclass(frozen=True, eq=False)
class Chosen:
    """A law: as a name or out of a fit.

    Attributes:
        text: what it is called.
        law: with its numbers.
        drive: that it was fitted in.
        forces: coefficients that are forces, as the load was not known.
    """

    text: str
    law: AnyLaw
    drive: Drive | None = None
    forces: tuple[str, ...] = ()

    @property
    def turning(self) -> bool:
        """Whether it was fitted to an axis that turns."""
        return self.drive is not None and self.drive.turning


def chosen_law(fit: Path | None, law: str | None) -> Chosen:
    """The law of a fit, or the one that a name means.

    Raises:
        ValueError: both or none, a robot, no fit in the file, a fit without a law.
    """
    if (fit is None) == (law is None):
        got = "neither" if fit is None else "both"
        raise ValueError(f"codegen: expected --law NAME or the file of a fit, got {got}")
    if fit is None:
        text = str(law)
        return Chosen(text, any_from_text(text))
    from identification.result.fitted import Fitted  # noqa: PLC0415  (SciPy is slow to import)

    if fit.suffix.lower() == ".urdf":
        raise ValueError(
            f"codegen '{fit}': expected --inverse-dynamics with a robot, got none; "
            "its plant is --scene FILE.urdf --law NAME"
        )
    found = Fitted.from_json(fit)
    if found.law is None:
        raise ValueError(
            f"fit '{fit}': expected a law, got {found.name}, a model without one or with several, "
            "or a law of your own; generate it in Python: symfric.codegen.generate(fit.law, out)"
        )
    if found.status is not Status.SOLVED:
        first = found.message.partition(". ")[0].rstrip(".")
        output.note(f"{fit}: the fit ended {found.status.name}: {first}.")
    units = {n: p.unit for n, p in parameters(found.law).items()}
    forces = [n for n, e in found.parameters.items() if units.get(n) == "1" and e.unit != "1"]
    return Chosen(found.name, found.law, found.drive, tuple(forces))


def machine_of(
    scene: str, kind: Callable[[Law], Scene], chosen: Chosen, texts: dict[str, str]
) -> Scene:
    """The scene with the law and the texts of --set; of a fitted drive with mass and offset, too.

    Raises:
        ValueError: coefficients that are forces in a scene that has a load of its own; unknown
            names.
    """
    if kind is Drive and chosen.drive is not None:
        machine: Scene = chosen.drive
    else:  # a population is refused by its name
        machine = kind(chosen.law if isinstance(chosen.law, Law) else law_from_text(chosen.text))
    own = machine is chosen.drive
    machine = formed(machine, texts)
    made = {n for n in texts if n in forms(machine)}
    check_names(f"--set of {scene}", texts, [*parameters(machine), *forms(machine)])
    values = {n: checks.parsed(f"--set {n}", texts[n]) for n in texts if n not in made}
    if chosen.forces and not own and values.get("N") != 1.0:
        names = ", ".join(chosen.forces)
        hint = "--set N=1" if "N" in parameters(machine) else "fit it with --normal-force"
        raise ValueError(
            f"codegen: --scene {scene}: expected coefficients of friction, got forces {names}, "
            f"fitted under a load of 1 N; {hint}"
        )
    return with_values(machine, values)


def to_dict(
    law: str, generated: Generated, verification: Verification, measured: Sequence[Measured]
) -> dict[str, Any]:
    """What `--json` holds."""
    return {
        "law": law,
        "files": [str(path) for path in generated.files],
        "manifest": dict(generated.manifest),
        "verification": verification.to_dict(),
        "cores": [m.to_dict() for m in measured],
    }
