"""`symfric codegen`: generate C99 for a friction law or a plant and verify it on this machine."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from symfric.cli import codegen_subject as subjects
from symfric.cli import completions, output
from symfric.cli import options as opt
from symfric.cli.machines import LawOfOption, PresetOption, kind_of
from symfric.cli.options import argument, option
from symfric.codegen import Block, Generated, Verification, generate, plant_block, verify
from symfric.codegen.generated import with_cores
from symfric.codegen.verification import Check
from symfric.embedded import CORES, Measured, measure
from symfric.foundation import checks
from symfric.foundation.parameters import check_names
from symfric.foundation.programs import find_compiler
from symfric.laws import AnyLaw

REALS = {"double": ("double",), "float": ("float",), "both": ("double", "float")}


def codegen(
    out: Annotated[Path, option("--out DIR", "Folder for the files.")],
    fit: Annotated[
        Path | None,
        argument(
            "FIT.json|ROBOT.urdf",
            "Output of `symfric identify --json`; or a robot, with --inverse-dynamics.",
        ),
    ] = None,
    law: Annotated[
        str | None,
        option("--law NAME", "Friction law, such as lugre; or FIT.json.", completions.laws),
    ] = None,
    settings: opt.SetOption = None,
    preset: PresetOption = None,
    law_of: LawOfOption = None,
    scene: Annotated[
        str | None,
        option(
            "--scene NAME",
            "Plant: this scene, or FILE.urdf, with the law.",
            completions.scenes,
        ),
    ] = None,
    method: Annotated[
        str | None,
        option(
            "--method NAME",
            "Method of a plant; default rodas3, for mechanisms with friction backward_euler.",
        ),
    ] = None,
    real: Annotated[
        str | None,
        option(
            "--real",
            "Floating point type; default both, for a plant double.",
            metavar="|".join(REALS),
        ),
    ] = None,
    step_size: Annotated[
        float | None,
        option("--step-size SECONDS", "Constant step, for plants and laws with states."),
    ] = None,
    name: Annotated[
        str | None, option("--name NAME", "C identifier; default: that of the law.")
    ] = None,
    fold: Annotated[
        bool, option("--fold", "Make all parameters constants; default: all are variable.")
    ] = False,
    free: Annotated[
        list[str] | None,
        option("--free NAME", "Keep this parameter variable; others are constants."),
    ] = None,
    guards: Annotated[
        bool, option("--guards/--no-guards", "Clamp, repair and report invalid inputs.")
    ] = True,
    kit: Annotated[
        bool,
        option("--kit/--no-kit", "Add unit test, CMake, Python and Simulink files."),
    ] = True,
    core: Annotated[
        list[str] | None,
        option("--core NAME", f"Measure on this core: {', '.join(CORES)}."),
    ] = None,
    turning: Annotated[
        bool, option("--turning", "Rotation: units rad/s and N m in the header.")
    ] = False,
    inverse_dynamics: Annotated[
        bool,
        option(
            "--inverse-dynamics",
            "Joint forces for a motion of ROBOT.urdf or --scene, with the friction of --law or of "
            "the file.",
        ),
    ] = False,
    payload: Annotated[
        str | None, option("--payload FRAME", "Link or frame with a load that is set at run time.")
    ] = None,
    tunable_gravity: Annotated[
        bool, option("--tunable-gravity", "Set gravity at run time.")
    ] = False,
    compensator: Annotated[
        bool, option("--compensator", "Friction compensator of the law or of a fit.")
    ] = False,
    compensation: Annotated[
        list[str] | None,
        option(
            "--compensation NAME=VALUE",
            "Setting, such as v_blend=0.02, scales=coulomb:0.9,stribeck:0, limit=5. All: "
            f"{', '.join(subjects.SETTINGS)}.",
        ),
    ] = None,
    compiler: Annotated[
        str | None, option("--compiler COMMAND", "Default: $CC, gcc or clang.")
    ] = None,
    json: opt.JsonOption = None,
) -> None:
    """Write a friction law, a plant or inverse dynamics as C99, and verify it.

    The C is compiled and compared with CasADi over more than 20 000 steps, including bad inputs and
    other parameters. The exit status is 1 if it differs or could not be verified, for example
    without a compiler; the files are written anyway.
    The law of a fit has the fitted parameters, and so has its drive with `--scene drive`.

    Example: symfric codegen --law lugre --out build --step-size 0.001

    Example: symfric codegen robot.urdf --inverse-dynamics --payload tool0 --out build

    Example: symfric codegen fit.json --compensator --compensation v_blend=0.02 --out build
    """
    check_names("--core", core or (), CORES)
    opt.check_folder(out)
    opt.check_outputs(json)
    if compiler is not None:
        find_compiler(checks.text("--compiler", compiler, "a C compiler"))
    chosen = None if inverse_dynamics else subjects.chosen_law(fit, law)
    subject = subjects.subject_of(chosen, scene, compensator)
    kind = real
    if kind is None:
        kind = "double" if subject == subjects.PLANT else "both"
    check_names("--real", [kind], REALS)
    given = {
        "--step-size": step_size is not None, "--method": method is not None, "--free": bool(free),
        "--fold": fold, "--turning": turning, "--payload": payload is not None,
        "--tunable-gravity": tunable_gravity, "--compensation": bool(compensation),
        "--preset": preset is not None, "--law-of": bool(law_of),
    }  # fmt: skip
    subjects.check_applicable(subject, [option for option, there in given.items() if there])
    own: dict[str, Any] = {"fold": fold or None, "free": free or None, "name": name, "h": step_size}
    own = {option: value for option, value in own.items() if value is not None}
    adjustable, forces = None, ()
    if chosen is None:
        values = opt.numbers("--set", settings)
        made: Block | AnyLaw = subjects.robot_block(
            fit, scene, law, values,
            name=name, h=step_size, fold=fold, payload=payload, tunable_gravity=tunable_gravity,
        )  # fmt: skip
        text, own = law or made.name, {}
    elif scene is not None:
        kind_of_scene = kind_of(scene, "--scene", preset, law_of)
        machine = subjects.machine_of(
            scene, kind_of_scene, chosen, opt.assignments("--set", settings)
        )
        own["method"] = "auto" if method is None else method
        made = plant_block(machine, **own)
        adjustable = partial(plant_block, machine, **{n: v for n, v in own.items() if n != "h"})
        text, own = chosen.text, {}
    elif compensator:
        compensated = opt.with_settings(chosen.law, chosen.text, settings)
        made = subjects.compensator_block(
            compensated, chosen.drive, compensation or (),
            name=name, h=step_size, turning=turning, fold=fold,
        )  # fmt: skip
        text, own = chosen.text, {}
    else:
        made = opt.with_settings(chosen.law, chosen.text, settings)
        if turning or chosen.turning:
            own["turning"] = True
        text, forces = chosen.text, chosen.forces
    generated = generate(made, out, real=REALS[kind], guards=guards, kit=kit, **own)
    verification = verify(generated, compiler=compiler, adjustable=adjustable)
    if forces:
        names = ", ".join(forces)
        output.note(f"{names}: fitted as forces under a load of 1 N; call the C with N = 1")
    measured = on_cores(generated, core or ())
    generated = with_cores(generated, [m.to_dict() for m in measured])
    _report(text, generated, verification, measured, json)


def _report(
    text: str,
    generated: Generated,
    verification: Verification,
    measured: list[Measured],
    json: str | None,
) -> None:
    """Print files and verification; the exit status is 1 if it failed."""
    output.emit_json(to_dict(text, generated, verification, measured), json)
    if json != "-":
        show_verification(verification)
        show_sizes(generated, measured)
    output.say_folder(generated.folder, generated.files)
    output.say_written(json)
    if not verification.ok:
        raise typer.Exit(1)


def on_cores(generated: Generated, cores: Sequence[str]) -> list[Measured]:
    """Measure the block on Cortex-M cores in every generated type."""
    return [
        measure(generated.block, real, core, guards=generated.guards)
        for core in cores
        for real in generated.reals
    ]


def to_dict(
    law: str, generated: Generated, verification: Verification, measured: Sequence[Measured]
) -> dict[str, Any]:
    """Return the content of `--json`."""
    return {
        "law": law,
        "files": [str(path) for path in generated.files],
        "manifest": dict(generated.manifest),
        "verification": verification.to_dict(),
        "cores": [m.to_dict() for m in measured],
    }


def show_verification(verification: Verification) -> None:
    """Print the comparison of the C with CasADi, one row per floating point type."""
    compiler = f" ({verification.compiler})" if verification.compiler else ""
    output.show(f"{verification.name}: {verification.status}{compiler}")
    if verification.checks:
        output.show_table(
            ["type", "steps", "warnings", "against CasADi", "error", "output", "foreign"],
            [
                (
                    check.real,
                    check.steps,
                    len(check.warnings),
                    compared(check),
                    f"{check.error:.2g}",
                    check.worst or "-",
                    ", ".join(check.foreign or ()) or "none",
                )
                for check in verification.checks
            ],
        )
    for check in verification.checks:
        if check.ties:
            output.show(
                f"{check.real}: in {check.ties} of {check.steps} steps rounding decides a mode, "
                "in CasADi as in C"
            )


def compared(check: Check) -> str:
    """Describe the comparison of the C with CasADi."""
    return "differs" if check.ulp is None and not check.near else bits(check.ulp)


def bits(ulp: int | None) -> str:
    """Describe the distance of the C in double from CasADi."""
    if ulp is None:
        return "within rounding"
    return "bit for bit equal" if ulp == 0 else f"{ulp} ulp apart"


def show_sizes(generated: Generated, measured: Sequence[Measured]) -> None:
    """Print memory on this machine, by size and -fstack-usage, and cost on other cores, by QEMU."""
    rows: list[tuple[str | float, ...]] = []
    for real in generated.reals:
        found = generated.manifest["real"][real].get("measured")
        if found is not None:
            stack = max(found["stack"].values(), default="-")
            rows.append((real, found["compiler"], found["text"] or "-", stack, "-", "-"))
    for m in measured:
        cells = (m.text, m.stack, m.average, m.maximum) if m.ok else ("-", "-", "-", "-")
        numbers = (f"{x:.0f}" if isinstance(x, float) else x for x in cells)
        rows.append((m.real, m.core, *numbers))
    if rows:
        head = ["type", "compiler or core", "code [B]", "stack [B]", "average instructions",
                "most instructions"]  # fmt: skip
        output.show_table(head, rows)
    for core, status in dict.fromkeys((m.core, m.status) for m in measured if not m.ok):
        output.show(f"{core}: {status}")
