"""Subjects of `symfric codegen`: laws, plants, robots, compensators, and their options."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import final

from symfric import Law, any_from_text, law_from_text, with_values
from symfric.cli import output
from symfric.cli.machines import formed, forms, kind_of
from symfric.codegen import Block, inverse_dynamics_block
from symfric.compensation import Compensation, compensator, settings_from_text
from symfric.foundation import checks
from symfric.foundation.parameters import check_names, parameters
from symfric.foundation.status import Status
from symfric.laws import AnyLaw
from symfric.multibody import Mechanism, read_urdf
from symfric.scenes import Drive, Scene
from symfric.scenes.linkages import MechanismScene

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
"""Options that apply to some subjects only -> these subjects."""

WHY = {
    "--step-size": "which has no step",
    "--method": "whose step is fixed by the law",
    "--turning": "which defines the units",
}


@final
@dataclass(frozen=True, eq=False)
class Chosen:
    """Law given by name or by a fit.

    Attributes:
        text: name of the law.
        law: law with its parameters.
        drive: drive of the fit.
        forces: coefficients that are forces because the load is unknown.
    """

    text: str
    law: AnyLaw
    drive: Drive | None = None
    forces: tuple[str, ...] = ()

    @property
    def turning(self) -> bool:
        """True if the law was fitted to a rotating axis."""
        return self.drive is not None and self.drive.turning


def subject_of(chosen: Chosen | None, scene: str | None, compensator: bool) -> str:
    """Return the type of subject.

    Raises:
        ValueError: a compensator together with a scene or inverse dynamics.
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
    """Refuse all options that do not apply to the subject in one error."""
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


def chosen_law(fit: Path | None, law: str | None) -> Chosen:
    """Return the law of a fit or of a name.

    Raises:
        ValueError: both or neither, a robot, no fit in the file, or a fit without a law.
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
            f"fit '{fit}': expected a law of the catalogue, got {found.name}; generate other laws "
            "in Python: symfric.codegen.generate(fit.law, out)"
        )
    if found.status is not Status.SOLVED:
        first = found.message.partition(". ")[0].rstrip(".")
        output.note(f"{fit}: status of the fit {found.status.name}: {first}.")
    units = {n: p.unit for n, p in parameters(found.law).items()}
    forces = [n for n, e in found.parameters.items() if units.get(n) == "1" and e.unit != "1"]
    return Chosen(found.name, found.law, found.drive, tuple(forces))


def machine_of(
    scene: str, kind: Callable[[Law], Scene], chosen: Chosen, texts: dict[str, str]
) -> Scene:
    """Return the scene with the law and --set; a fitted drive includes its mass and offset.

    Raises:
        ValueError: coefficients that are forces in a scene with a load, or unknown names.
    """
    if kind is Drive and chosen.drive is not None:
        machine: Scene = chosen.drive
    else:  # `law_from_text` refuses a population
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


SETTINGS = tuple(item.name for item in fields(Compensation))
"""Settings of a compensator, for the help."""


def compensator_block(
    law: AnyLaw,
    drive: Drive | None,
    texts: Sequence[str],
    *,
    name: str | None,
    h: float | None,
    turning: bool,
    fold: bool,
) -> Block:
    """Return the compensator of a law, with load and offset of the drive of its fit.

    Args:
        law: law with its parameters.
        drive: drive of a fit.
        texts: settings NAME=VALUE, see `settings_from_text`.

    Raises:
        ValueError: a population; see also `compensator`.
    """
    if not isinstance(law, Law):
        raise ValueError(f"{COMPENSATOR}: expected a law, got a population, whose force is random")
    subject = law if drive is None else replace(drive, law=law)
    settings = settings_from_text(texts)
    return compensator(subject, settings=settings, name=name, h=h, turning=turning, fold=fold)


def robot_block(
    file: Path | None,
    scene: str | None,
    law: str | None,
    values: dict[str, float],
    *,
    name: str | None,
    h: float | None,
    fold: bool,
    payload: str | None,
    tunable_gravity: bool,
) -> Block:
    """Return the inverse dynamics of a robot's file or of a scene.

    Args:
        file, scene: one of them; a scene may also be a robot's file.
        law: law of all joints; None for the friction tags of a file.
        values: parameters of the scene or of the law, which become its defaults.
        fold: make the friction parameters constants.
        payload: frame with a load, whose inertia is a parameter, too.

    Raises:
        ValueError: both or neither of them, or no mechanism; see also `inverse_dynamics_block`.
    """
    where = file if scene is None else scene
    if where is None or (file is not None and scene is not None):
        got = "neither" if where is None else "both"
        raise ValueError(f"{INVERSE}: expected a robot's FILE.urdf or --scene NAME, got {got}")
    if file is not None and file.suffix.lower() != ".urdf":
        raise ValueError(f"{INVERSE}: expected a robot's FILE.urdf, got '{file}'")
    return inverse_dynamics_block(
        _mechanism(str(where), law, values),
        name=name,
        h=h,
        fold=fold,
        payload=payload,
        payload_inertia=payload is not None,
        tunable_gravity=tunable_gravity,
    )


def _mechanism(scene: str, law: str | None, values: dict[str, float]) -> Mechanism:
    if law is None and scene.endswith(".urdf"):
        if values:
            raise ValueError(f"{INVERSE}: --set: expected with --law only, got {', '.join(values)}")
        return read_urdf(scene)
    if law is None:
        raise ValueError(f"{INVERSE}: expected --law NAME with --scene {scene}, got none")
    machine = kind_of(scene, "--scene")(law_from_text(law))
    check_names(f"--set of {scene}", values, parameters(machine))
    if not isinstance(machine, MechanismScene):
        raise ValueError(f"{INVERSE}: expected a scene of bodies and joints, got {scene}")
    return with_values(machine, values).mechanism()
