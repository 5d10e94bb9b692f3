"""`symfric codegen`: a friction law as C99, verified on this machine."""

from pathlib import Path
from typing import Annotated, Any

import typer

from symfric.cli import output
from symfric.cli.options import JsonOption, LawOption, SetOption, check_folder, law_with
from symfric.codegen import Generated, Verification, generate, verify
from symfric.parameters import check_names

REALS = {"double": ("double",), "float": ("float",), "both": ("double", "float")}


def codegen(
    law: LawOption,
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the files.")],
    settings: SetOption = None,
    real: Annotated[str, typer.Option("--real", help="double, float or both.")] = "both",
    step_size: Annotated[
        float | None,
        typer.Option("--step-size", help="Step [s] as a constant, for laws with states."),
    ] = None,
    name: Annotated[
        str | None, typer.Option("--name", help="C identifier; default from the law.")
    ] = None,
    free: Annotated[
        list[str] | None,
        typer.Option("--free", metavar="NAME", help="Keep this one variable, fold the others."),
    ] = None,
    compiler: Annotated[
        str | None, typer.Option("--compiler", help="Default: $CC, gcc or clang.")
    ] = None,
    json: JsonOption = None,
) -> None:
    """Write a friction law as C99 and verify it.

    The C is compiled and compared with CasADi over 20 000 steps.

    Example: symfric codegen --law lugre --out build --step-size 0.001
    """
    check_names("--real", [real], REALS)
    check_folder(out)
    generated = generate(
        law_with(law, settings), out, name=name, real=REALS[real], h=step_size, free=free
    )
    verification = verify(generated, compiler=compiler)
    output.emit_json(to_dict(law, generated, verification), json)
    if json != "-":
        show_verification(verification)
    output.say_written(*generated.files, json)
    if verification.checks and not verification.ok:
        raise typer.Exit(1)


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
