"""`symfric codegen`: a friction law, or a scene as a plant, as C99, verified on this machine."""

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any, final

import typer

from symfric import Law, any_from_text, law_from_text, with_values
from symfric.cli import output
from symfric.cli.codegen_robot import robot_block
from symfric.cli.options import (
    JsonOption,
    SetOption,
    check_folder,
    check_outputs,
    numbers,
    with_settings,
)
from symfric.cli.run import kind_of
from symfric.codegen import Block, Generated, Verification, generate, plant_block, verify
from symfric.foundation import checks
from symfric.foundation.compiler import find_compiler
from symfric.foundation.parameters import check_names, parameters
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
        typer.Option("--law", metavar="NAME", help="Friction law, such as lugre; or FIT.json."),
    ] = None,
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
    compiler: Annotated[
        str | None, typer.Option("--compiler", help="Default: $CC, gcc or clang.")
    ] = None,
    json: JsonOption = None,
) -> None:
    """Write a friction law, a plant or inverse dynamics as C99, and verify it.

    The C is compiled and compared with CasADi over 20 000 steps. The exit status is 1 where it
    could not be verified, as without a compiler, or differs; the files are written all the same.
    The law of a fit has the fitted numbers, and so has its drive with `--scene drive`.

    Example: symfric codegen --law lugre --out build --step-size 0.001

    Example: symfric codegen robot.urdf --inverse-dynamics --payload tool0 --out build
    """
    kind = real
    if kind is None:
        kind = "both" if scene is None or inverse_dynamics else "double"
    check_names("--real", [kind], REALS)
    check_folder(out)
    check_outputs(json)
    if compiler is not None:
        find_compiler(checks.text("--compiler", compiler, "a C compiler"))
    if inverse_dynamics:
        _refuse({"--method": method, "--free": free, "--turning": turning or None})
        block = robot_block(
            fit, scene, law, numbers("--set", settings),
            name=name, h=step_size, payload=payload, tunable_gravity=tunable_gravity,
        )  # fmt: skip
        generated = generate(block, out, real=REALS[kind])
        _proved(law or block.name, generated, verify(generated, compiler=compiler), json)
        return
    if payload is not None or tunable_gravity:
        raise ValueError("--payload, --tunable-gravity: expected with --inverse-dynamics only")
    chosen = chosen_law(fit, law)
    adjustable = None
    if scene is not None and turning:
        raise ValueError("--turning: expected with a law only: a scene knows what turns")
    if scene is not None:
        machine = machine_of(scene, chosen, numbers("--set", settings))
        made = partial(plant, machine, "auto" if method is None else method, name, free)
        generated, adjustable = generate(made(step_size), out, real=REALS[kind]), made
    elif method is not None:
        raise ValueError("--method: expected with --scene only: the step of a law is exact")
    else:
        generated = generate(
            with_settings(chosen.law, chosen.text, settings),
            out,
            name=name,
            real=REALS[kind],
            h=step_size,
            free=free,
            turning=turning or chosen.turning,
        )
    verification = verify(generated, compiler=compiler, adjustable=adjustable)
    if chosen.forces and scene is None:
        names = ", ".join(chosen.forces)
        output.note(f"{names}: forces, fitted under a load of 1 N; call the C with N = 1")
    _proved(chosen.text, generated, verification, json)


def _refuse(given: dict[str, object]) -> None:
    """Options that say nothing to inverse dynamics."""
    wrong = [name for name, value in given.items() if value is not None]
    if wrong:
        raise ValueError(f"--inverse-dynamics: expected no {', '.join(wrong)}, got one")


def _proved(text: str, generated: Generated, verification: Verification, json: str | None) -> None:
    """Say what was written and whether it was verified; the exit status says it, too."""
    output.emit_json(to_dict(text, generated, verification), json)
    if json != "-":
        show_verification(verification)
    output.say_written(*generated.files, json)
    if not verification.ok:
        raise typer.Exit(1)


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
        ValueError: both or none, no fit in the file, a fit without a law.
    """
    if (fit is None) == (law is None):
        got = "neither" if fit is None else "both"
        raise ValueError(f"codegen: expected --law NAME or the file of a fit, got {got}")
    if fit is None:
        text = str(law)
        return Chosen(text, any_from_text(text))
    from identification.result.fitted import Fitted  # noqa: PLC0415  (SciPy is slow to import)

    found = Fitted.from_json(fit)
    if found.law is None:
        raise ValueError(
            f"fit '{fit}': expected a law, got {found.name}, a model without one or with several, "
            "or a law of your own; generate it in Python: symfric.codegen.generate(fit.law, out)"
        )
    units = {n: p.unit for n, p in parameters(found.law).items()}
    forces = [n for n, e in found.parameters.items() if units.get(n) == "1" and e.unit != "1"]
    return Chosen(found.name, found.law, found.drive, tuple(forces))


def machine_of(scene: str, chosen: Chosen, values: dict[str, float]) -> Scene:
    """The scene with the law; of a fitted drive with its mass and offset, too."""
    kind = kind_of(scene, "--scene")
    if kind is Drive and chosen.drive is not None:
        machine: Scene = chosen.drive
    else:  # a population is refused by its name
        machine = kind(chosen.law if isinstance(chosen.law, Law) else law_from_text(chosen.text))
    check_names(f"--set of {scene}", values, parameters(machine))
    return with_values(machine, values)


def plant(
    machine: Scene, method: str, name: str | None, free: list[str] | None, h: float | None = None
) -> Block:
    """The plant of a scene, whose other parameters are listed as constants."""
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
