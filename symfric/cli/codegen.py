"""`symfric codegen`: generate C99 for a friction law or a plant and verify it on this machine."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import typer

from symfric import Drive as Nameplate
from symfric import Law, with_values
from symfric.cli import options as opt
from symfric.cli import output
from symfric.cli.codegen_results import FIXED, REALS, report, write_controllers, write_fixed
from symfric.cli.machines import OwnMachine, kind_of, settable, with_set
from symfric.cli.options import Strings
from symfric.codegen import (
    Block,
    Generated,
    Verification,
    generate,
    inverse_dynamics_block,
    plant_block,
    verify,
)
from symfric.codegen import prove as prove_block
from symfric.codegen.blocks.variables import STEP_SIZE
from symfric.codegen.generated import with_cores
from symfric.compensation import (
    Adaptation,
    Compensation,
    kalman_estimator,
    recursive_estimator,
    settings_from_text,
)
from symfric.compensation import compensator as compensator_block
from symfric.compensation.settings import adaptation_from_text
from symfric.embedded import CORES, StepError, measure, step_errors
from symfric.foundation import checks
from symfric.foundation.files import check_folder
from symfric.foundation.parameters import check_names, parameters
from symfric.foundation.programs import find_compiler
from symfric.foundation.status import SolveError, Status
from symfric.laws import AnyLaw
from symfric.multibody import Mechanism, read_urdf
from symfric.scenes import Drive, Scene
from symfric.scenes.linkages import MechanismScene

COMPENSATION = [item.name for item in fields(Compensation)]
ADAPTATION = [item.name for item in fields(Adaptation)]
ESTIMATORS = {"recursive": recursive_estimator, "kalman": kalman_estimator}
LAW, FUNCTION, POPULATION = "a law", "a law without states", "a population"
PLANT, INVERSE, COMPENSATOR = "--scene", "--inverse-dynamics", "--compensator"
ESTIMATOR = "--estimator"

APPLIES = {
    "--step-size": (LAW, POPULATION, PLANT, INVERSE, COMPENSATOR, ESTIMATOR),
    "--method": (PLANT,),
    "--free": (LAW, FUNCTION, PLANT),
    "--fold": (LAW, FUNCTION, PLANT, INVERSE, COMPENSATOR),
    "--turning": (LAW, FUNCTION, COMPENSATOR, ESTIMATOR),
    "--payload": (INVERSE,),
    "--compensation": (COMPENSATOR,),
    "--tunable-gravity": (INVERSE,),
    "--preset": (PLANT,),
    "--law-of": (PLANT,),
    "--adaptation": (ESTIMATOR,),
    "--drive": (COMPENSATOR,),
}
"""Option that applies only to some subjects -> these subjects."""

WHY = {
    "--step-size": "which has no step",
    "--method": "whose step is fixed by the law",
    "--turning": "which defines the units",
}


class Chosen(NamedTuple):
    """Law given by name or by a fit.

    Attributes:
        text: name of the law.
        law: law with its parameters.
        drive: drive of the fit, if the law is from a fit of a drive.
        forces: coefficients that are forces because the load is unknown.
    """

    text: str
    law: AnyLaw
    drive: Drive | None = None
    forces: tuple[str, ...] = ()


def codegen(
    out: Path,
    fit: Path | None = None,
    law: str | None = None,
    settings: Strings = None,
    preset: str | None = None,
    law_of: Strings = None,
    scene: str | None = None,
    method: str | None = None,
    real: str | None = None,
    ranges: Strings = None,
    step_size: float | None = None,
    name: str | None = None,
    fold: bool = False,
    free: Strings = None,
    guards: bool = True,
    kit: bool = True,
    core: Strings = None,
    turning: bool = False,
    inverse_dynamics: bool = False,
    payload: str | None = None,
    tunable_gravity: bool = False,
    compensator: bool = False,
    compensation: Strings = None,
    drive: Path | None = None,
    estimator: str | None = None,
    adaptation: Strings = None,
    mpc: str | None = None,
    accept: Strings = None,
    prove: bool = False,
    compiler: str | None = None,
    json: str | None = None,
) -> None:
    """Write a law, plant, compensator or controller as C99, and verify it.

    The C is compiled and compared with CasADi over more than 20 000 steps, including bad inputs and
    other parameters. The exit status is 1 if the results differ or could not be compared, for
    example without a compiler; the files are written in any case. The law of a fit has the fitted
    parameters; with `--scene drive` the drive also has them. A parameter that the data do not
    determine is refused, unless --set gives its value or --accept names it.

    Example: symfric codegen lugre --out build --step-size 0.001

    Example: symfric codegen robot.urdf --inverse-dynamics --payload tool0 --out build

    Example: symfric codegen fit.json --compensator --compensation v_blend=0.02 --out build

    Example: symfric codegen fit.json --compensator --drive drive.toml --out build

    Example: symfric codegen --mpc problem.py --real float --core m4f --out build

    Example: symfric codegen fit.json --estimator recursive --adaptation noise=1e-4 --out build

    Example: symfric codegen stribeck --real fixed --range v=-1:1 --range N=0:20 --out build
    """
    given = opt.changed(codegen, locals())
    check_names("--core", core or (), CORES)
    check_folder(out)
    opt.check_outputs(json)
    if prove and not guards:
        raise ValueError("--prove: expected guards, whose effect is proved, got --no-guards")
    if compiler is not None:
        find_compiler(checks.text("--compiler", compiler, "a C compiler"))
    if mpc is not None:
        return write_controllers(out, mpc, given, settings, step_size, real, core, json)
    if fit and not law and fit.suffix.lower() not in (".json", ".urdf") and not fit.is_file():
        fit, law = None, str(fit)
    texts = opt.assignments("--set", settings)
    chosen = None if inverse_dynamics else chosen_law(fit, law, accept or (), texts)
    subject = subject_of(chosen, scene, compensator, estimator)
    if real == FIXED or ranges:
        if chosen is None or not isinstance(chosen.law, Law):
            raise ValueError(f"--real fixed: expected a law, got {subject}")
        made = opt.with_settings(chosen.law, chosen.text, texts)
        return write_fixed(out, made, given, ranges, step_size, name, core, compiler, json)
    kind = ("double" if subject == PLANT else "both") if real is None else real
    check_names("--real", [kind], REALS)
    check_applicable(subject, [option for option in APPLIES if option in given])
    own: dict[str, Any] = {"fold": fold or None, "free": free, "name": name, "h": step_size}
    own = {option: value for option, value in own.items() if value is not None}
    options, adjustable = dict[str, Any](), None
    errors: tuple[StepError, ...] = ()
    if chosen is None:
        made: Block | AnyLaw = inverse_dynamics_block(
            robot(fit, scene, law, opt.numbers("--set", texts)), **own, payload=payload,
            payload_inertia=payload is not None, tunable_gravity=tunable_gravity,
        )  # fmt: skip
    elif scene is not None:
        machine = machine_of(scene, kind_of(scene, "--scene", preset, law_of), chosen, texts)
        made, errors, adjustable = plant(machine, method=method or "auto", **own)
    else:
        made = opt.with_settings(chosen.law, chosen.text, texts)
        if subject in (COMPENSATOR, ESTIMATOR):
            own |= {} if drive is None else {"drive": Nameplate.read(drive)}
            texts_of = compensation or adaptation or ()
            made = online(made, chosen.drive, estimator, texts_of, turning=turning, **own)
        else:
            options = own
            if turning or (chosen.drive is not None and chosen.drive.turning):
                options["turning"] = True
    generated = generate(made, out, real=REALS[kind], guards=guards, kit=kit, **options)
    if chosen is not None and chosen.forces and subject in (LAW, FUNCTION):
        names = ", ".join(chosen.forces)
        output.note(f"{names}: fitted as forces under a load of 1 N; call the C with N = 1")
    law = chosen.text if chosen else law or generated.block.name
    verification = verify(generated, compiler=compiler, adjustable=adjustable)
    finish(law, generated, verification, errors, core or (), prove, json)


def finish(
    law: str, generated: Generated, verification: Verification, errors: Sequence[StepError],
    cores: Sequence[str], prove: bool, json: str | None,
) -> None:  # fmt: skip
    """Measure on cores, prove, and report; exit with 1 unless everything holds."""
    measured = [
        measure(generated.block, real, core, guards=generated.guards)
        for core in cores for real in generated.reals
    ]  # fmt: skip
    generated = with_cores(generated, [m.to_dict() for m in measured])
    proofs = [prove_block(generated.block, real) for real in generated.reals if prove]
    report(law, generated, verification, measured, proofs, errors, json)
    if not verification.ok or not all(found.ok for found in proofs):
        raise typer.Exit(1)


def subject_of(
    chosen: Chosen | None, scene: str | None, compensator: bool, estimator: str | None
) -> str:
    """Return the type of the subject, a key of `APPLIES`.

    Raises:
        ValueError: a compensator or an estimator together with each other, with a scene or with
            inverse dynamics; an unknown estimator.
    """
    online = COMPENSATOR if compensator else ESTIMATOR
    if compensator or estimator is not None:
        both = (ESTIMATOR,) * (compensator and estimator is not None)
        others = [*both, *[INVERSE] * (chosen is None), *[PLANT] * (scene is not None)]
        if others:
            raise ValueError(f"codegen: {online}: expected with a law or a fit, got {others[0]}")
        if estimator is not None:
            checks.choice(ESTIMATOR, estimator, ESTIMATORS)
        return online
    if chosen is None:
        return INVERSE
    if scene is not None:
        return PLANT
    if not isinstance(chosen.law, Law):
        return POPULATION
    return LAW if chosen.law.states else FUNCTION


def check_applicable(subject: str, given: list[str]) -> None:
    """Raise one error that lists all options that do not apply to the subject."""
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


def chosen_law(
    fit: Path | None, law: str | None, accepted: Sequence[str], given: Mapping[str, str]
) -> Chosen:
    """Return the law of a fit or of a name.

    Raises:
        ValueError: both or neither, the file of a robot, a file without a fit, a fit without a law
            of the catalogue, or one with a parameter without an interval that is neither `accepted`
            nor `given`.
    """
    if (fit is None) == (law is None):
        got = "neither" if fit is None else "both"
        raise ValueError(f"codegen: expected the name of a law or the file of a fit, got {got}")
    if fit is None:
        if accepted:
            raise ValueError("--accept: expected with a fit only, got the name of a law")
        text = str(law)
        return Chosen(text, opt.any_named_law(text))
    from identification.result.fitted import Fitted  # noqa: PLC0415  (slow to import)

    if fit.suffix.lower() == ".urdf":
        raise ValueError(
            f"codegen '{fit}': expected --inverse-dynamics with a robot, got none; "
            "its plant is --scene FILE.urdf --law NAME"
        )
    found = Fitted.from_json(fit)
    if found.law is None:
        raise ValueError(
            f"fit '{fit}': expected a law of the catalogue, got {found.name}; generate other laws "
            "in Python: symfric.codegen.generate(fit.law, out)"
        )
    if found.status is not Status.SOLVED:
        first = found.message.partition(". ")[0].rstrip(".")
        output.note(f"{fit}: status of the fit {found.status.name}: {first}.")
    units = {n: p.unit for n, p in parameters(found.law).items()}
    free = {n: e for n, e in found.parameters.items() if n in units and not e.fixed}
    check_names("--accept", accepted, free)
    if vague := [n for n, e in free.items() if e.low is None and n not in {*accepted, *given}]:
        raise ValueError(
            f"codegen '{fit}': expected parameters that the data determine, got {', '.join(vague)} "
            f"without an interval; give --set {vague[0]}=VALUE or --accept {vague[0]}"
        )
    forces = [n for n, e in found.parameters.items() if units.get(n) == "1" and e.unit != "1"]
    return Chosen(found.name, found.law, found.drive, tuple(forces))


def machine_of(
    scene: str, kind: Callable[[Law], Scene], chosen: Chosen, texts: dict[str, str]
) -> Scene:
    """Return the scene with the law and the values of --set.

    A fitted drive has the fitted mass and offset.

    Raises:
        ValueError: coefficients that are forces in a scene with a load, or unknown names.
    """
    own = chosen.drive if kind is Drive else None
    # `named_law` refuses a population
    law = chosen.law if isinstance(chosen.law, Law) else opt.named_law(chosen.text)
    machine = own or kind(law)
    check_names(f"--set of {scene}", texts, settable(machine, texts))
    machine = with_set(machine, texts)
    if chosen.forces and own is None and float(texts.get("N", 0)) != 1.0:
        names = ", ".join(chosen.forces)
        hint = "--set N=1" if "N" in parameters(machine) else "fit it with --normal-force"
        raise ValueError(
            f"codegen: --scene {scene}: expected coefficients of friction, got forces {names}, "
            f"fitted under a load of 1 N; {hint}"
        )
    return machine


def plant(
    machine: Scene, h: float | None = None, **how: Any
) -> tuple[Block, tuple[StepError, ...], Callable[[], Block]]:
    """Return the block of a plant, its errors, and a function for the block with h variable.

    The errors are those of steps around h with the inputs of the scene, unless its motion is
    shorter than h or unknown.
    """
    source = machine.model() if isinstance(machine, OwnMachine) else machine
    block, size = plant_block(source, h=h, **how), STEP_SIZE if h is None else h
    errors: tuple[StepError, ...] = ()
    if size < machine.t_end:
        inputs = {name: own.function for name, own in machine.inputs.items()}
        try:
            errors = step_errors(machine, size, machine.t_end, u=inputs, method=how["method"])
        except SolveError as error:
            output.note(f"errors of fixed steps were not measured: {error}")
    limits = (*block.limits, *(str(one) for one in errors if one.h == size))
    return replace(block, limits=limits), errors, partial(plant_block, source, **how)


def online(
    law: AnyLaw, axis: Drive | None, estimator: str | None, texts: Sequence[str], **how: Any
) -> Block:
    """Return the compensator or the estimator of a law, with the numbers of the fitted drive."""
    option = COMPENSATOR if estimator is None else ESTIMATOR
    if not isinstance(law, Law):
        raise ValueError(f"{option}: expected a law, got a population, whose force is random")
    subject = law if axis is None else replace(axis, law=law)
    if estimator is None:
        return compensator_block(subject, settings=settings_from_text(texts), **how)
    return ESTIMATORS[estimator](subject, adaptation_from_text(texts), **how)


def robot(
    file: Path | None, scene: str | None, law: str | None, values: dict[str, float]
) -> Mechanism:
    """Return the mechanism of the file of a robot or of a scene.

    Args:
        file, scene: one of the two; the scene may also be the file of a robot.
        law: law of all joints; None for the friction tags of a file.
        values: parameters of the scene or of the law, used as defaults of the mechanism.

    Raises:
        ValueError: both or neither are given, or the scene is not a mechanism.
    """
    if (file is None) == (scene is None):
        got = "neither" if scene is None else "both"
        raise ValueError(f"{INVERSE}: expected a robot's FILE.urdf or --scene NAME, got {got}")
    if file is not None and file.suffix.lower() != ".urdf":
        raise ValueError(f"{INVERSE}: expected a robot's FILE.urdf, got '{file}'")
    where = str(file or scene)
    if law is None and where.endswith(".urdf"):
        if values:
            raise ValueError(f"{INVERSE}: --set: expected with --law only, got {', '.join(values)}")
        return read_urdf(where)
    if law is None:
        raise ValueError(f"{INVERSE}: expected --law NAME with --scene {where}, got none")
    machine = kind_of(where, "--scene")(opt.named_law(law))
    check_names(f"--set of {where}", values, parameters(machine))
    if not isinstance(machine, MechanismScene):
        raise ValueError(f"{INVERSE}: expected a scene of bodies and joints, got {where}")
    return with_values(machine, values).mechanism()
