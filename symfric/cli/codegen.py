"""`symfric codegen`: a friction law, or a scene as a plant, as C99, verified on this machine."""

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from symfric.cli import output
from symfric.cli.options import (
    JsonOption,
    LawOption,
    SetOption,
    any_with,
    check_folder,
    check_outputs,
    numbers,
)
from symfric.cli.run import kind_of, scenes_with
from symfric.codegen import Block, Generated, Verification, generate, plant_block, verify
from symfric.foundation import checks
from symfric.foundation.compiler import find_compiler
from symfric.foundation.parameters import check_names, parameters

REALS = {"double": ("double",), "float": ("float",), "both": ("double", "float")}


def codegen(
    law: LawOption,
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the files.")],
    settings: SetOption = None,
    scene: Annotated[
        str | None,
        typer.Option(
            "--scene", metavar="NAME", help="The plant of this scene, or FILE.urdf, with the law."
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
    free: Annotated[
        list[str] | None,
        typer.Option("--free", metavar="NAME", help="Keep this one variable, fold the others."),
    ] = None,
    turning: Annotated[
        bool, typer.Option("--turning", help="A law in rad/s and N m: units in the header.")
    ] = False,
    compiler: Annotated[
        str | None, typer.Option("--compiler", help="Default: $CC, gcc or clang.")
    ] = None,
    json: JsonOption = None,
) -> None:
    """Write a friction law or a plant as C99, and verify it.

    The C is compiled and compared with CasADi over 20 000 steps. The exit status is 1 where it
    could not be verified, as without a compiler, or differs; the files are written all the same.

    Example: symfric codegen --law lugre --out build --step-size 0.001
    """
    kind = real
    if kind is None:
        kind = "both" if scene is None else "double"
    check_names("--real", [kind], REALS)
    check_folder(out)
    check_outputs(json)
    if compiler is not None:
        find_compiler(checks.text("--compiler", compiler, "a C compiler"))
    adjustable = None
    if scene is not None and turning:
        raise ValueError("--turning: expected with a law only: a scene knows what turns")
    if scene is not None:
        made = partial(
            plant,
            scene,
            law,
            numbers("--set", settings),
            "auto" if method is None else method,
            name,
            free,
        )
        generated, adjustable = generate(made(step_size), out, real=REALS[kind]), made
    elif method is not None:
        raise ValueError("--method: expected with --scene only: the step of a law is exact")
    else:
        generated = generate(
            any_with(law, settings),
            out,
            name=name,
            real=REALS[kind],
            h=step_size,
            free=free,
            turning=turning,
        )
    verification = verify(generated, compiler=compiler, adjustable=adjustable)
    output.emit_json(to_dict(law, generated, verification), json)
    if json != "-":
        show_verification(verification)
    output.say_written(*generated.files, json)
    if not verification.ok:
        raise typer.Exit(1)


def plant(
    scene: str,
    law: str,
    values: dict[str, float],
    method: str,
    name: str | None,
    free: list[str] | None,
    h: float | None = None,
) -> Block:
    """The plant of a scene, whose other parameters are listed as constants."""
    kind_of(scene, "--scene")
    machine = scenes_with(scene, [law], values)[law]
    block = plant_block(machine.model(free or ()), h=h, method=method, name=name)
    known = {n: float(p.value) for n, p in parameters(machine).items() if n not in (free or ())}
    return replace(block, constants=known | dict(block.constants))


def to_dict(law: str, generated: Generated, verification: Verification) -> dict[str, Any]:
    """What `--json` holds."""
    return {
        "law": law,
        "files": [str(path) for path in generated.files],
        "manifest": dict(generated.manifest),
        "verification": verification.to_dict(),
    }


def show_verification(verification: Verification) -> None:
    """Print how the C compares with CasADi, one row a floating point type."""
    compiler = f" ({verification.compiler})" if verification.compiler else ""
    output.show(f"{verification.name}: {verification.status}{compiler}")
    if verification.checks:
        output.show_table(
            ["type", "steps", "warnings", "against CasADi", "error / peak", "foreign symbols"],
            [
                (
                    check.real,
                    check.steps,
                    len(check.warnings),
                    bits(check.ulp),
                    f"{check.error:.2g}",
                    ", ".join(check.foreign or ()) or "none",
                )
                for check in verification.checks
            ],
        )


def bits(ulp: int | None) -> str:
    """How near the C in double is to CasADi, in words."""
    if ulp is None:
        return "within rounding"
    return "bit for bit equal" if ulp == 0 else f"{ulp} ulp apart"
