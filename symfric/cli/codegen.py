"""`symfric codegen`: a friction law, or a scene as a plant, as C99, verified on this machine."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from symfric.cli import completions, output
from symfric.cli.codegen_compensator import SETTINGS, compensator_block
from symfric.cli.codegen_robot import robot_block
from symfric.cli.codegen_shown import show_sizes, show_verification
from symfric.cli.codegen_subject import (
    PLANT,
    check_applicable,
    chosen_law,
    machine_of,
    subject_of,
)
from symfric.cli.machines import LawOfOption, PresetOption, kind_of
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
from symfric.foundation.parameters import check_names
from symfric.laws import AnyLaw

REALS = {"double": ("double",), "float": ("float",), "both": ("double", "float")}


def codegen(
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the files.")],
    fit: Annotated[
        Path | None,
        typer.Argument(
            metavar="FIT.json|ROBOT.urdf",
            help="What `symfric identify --json` wrote; a robot with --inverse-dynamics.",
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
            metavar="NAME",
            help="Formula of a plant; default rodas3, of mechanisms with friction backward_euler.",
        ),
    ] = None,
    real: Annotated[
        str | None,
        typer.Option(
            "--real",
            metavar="|".join(REALS),
            help="Type of numbers; default both, double for a plant.",
        ),
    ] = None,
    step_size: Annotated[
        float | None,
        typer.Option(
            "--step-size",
            metavar="SECONDS",
            help="Step as a constant, for laws with states, plants.",
        ),
    ] = None,
    name: Annotated[
        str | None,
        typer.Option("--name", metavar="NAME", help="C identifier; default from the law."),
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
            help="What it does, such as v_blend=0.02, scales=coulomb:0.9,stribeck:0, limit=5. All: "
            f"{', '.join(SETTINGS)}.",
        ),
    ] = None,
    compiler: Annotated[
        str | None,
        typer.Option("--compiler", metavar="COMMAND", help="Default: $CC, gcc or clang."),
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
