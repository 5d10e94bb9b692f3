"""What `symfric codegen` makes C of, and which options say something to it."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import final

from symfric import Law, any_from_text, law_from_text, with_values
from symfric.cli import output
from symfric.cli.machines import formed, forms
from symfric.foundation import checks
from symfric.foundation.parameters import check_names, parameters
from symfric.foundation.status import Status
from symfric.laws import AnyLaw
from symfric.scenes import Drive, Scene

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


def subject_of(chosen: Chosen | None, scene: str | None, compensator: bool) -> str:
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
