"""Compensators and observers in the loop of a drive, on friction that they do not know."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

from symfric.bench.codegen_section import Cell, Goal, Section
from symfric.codegen import Block, law_block
from symfric.compensation import (
    Cascade,
    close_loop,
    compensator,
    disturbance_observer,
    gms_observer,
    lugre_observer,
    sine,
    step,
)
from symfric.embedded import measure as on_core
from symfric.laws import GMS, ElastoPlastic, ExactCoulomb, Law, LuGre
from symfric.laws.dynamic.maxwell_slip import Element
from symfric.scenes import drive

CURVE = {"mu_s": 6.0, "mu_d": 4.0, "v_s": 5e-3, "sigma_2": 20.0}
"""With N = 1 N the coefficients are newtons."""
BELIEVED = LuGre(sigma_0=1e5, sigma_1=300.0, **CURVE)
SPRINGS = tuple(Element(k, 0.25) for k in (1.5e5, 7.5e4, 4.5e4, 3e4))
SOFTER = tuple(Element(element.k / 2, element.alpha) for element in SPRINGS)
CONTROLLER = Cascade(kp=20.0, kv=60.0, ki=10.0)
GOAL = 5.0
"""Times that the RMS error is to be smaller."""
PROVEN = "excess 0"
"""The case whose numbers stand beside the goals."""


@final
@dataclass(frozen=True, eq=False)
class Trial:
    """Blocks that are tried together, with their cases."""

    blocks: tuple[Block, ...]
    cases: Mapping[str, Mapping[str, float]]
    noise: float = 0.0


def plants(quick: bool) -> dict[str, Law]:
    """Friction that the compensators do not know; those with events take longer."""
    found: dict[str, Law] = {
        "LuGre": LuGre(sigma_0=2e5, sigma_1=400.0, **CURVE),
        "elasto": ElastoPlastic(sigma_0=2e5, sigma_1=400.0, **CURVE),
    }
    if not quick:
        found["GMS"] = GMS(elements=SPRINGS, C=400.0, form="event", **CURVE)
        found["Coulomb"] = ExactCoulomb(form="stribeck", **CURVE)
    return found


def trials() -> list[Trial]:
    """The compensator of LuGre with numbers that are right and off, observers, and both."""
    law = compensator(BELIEVED, v_blend=0.02, error_gain=CONTROLLER.kp)
    plain = compensator(BELIEVED, v_blend=0.02)
    levels = {f"levels x {s:g}": _levels(s) for s in (1.0, 0.5, 0.8, 1.2)}
    force = disturbance_observer(CONTROLLER.inertia, 100.0)
    return [
        Trial((law,), levels | {PROVEN: {"scale_stribeck": 0.0}}),
        Trial((law,), {"and noise": {"scale_stribeck": 0.0}}, noise=3e-6),
        Trial((plain,), {"no k_error": {}}),
        Trial((lugre_observer(BELIEVED, 60.0),), {"observer": {}, "its k = 0": {"k_e": 0.0}}),
        Trial((gms_observer(GMS(elements=SOFTER, C=400.0, form="event", **CURVE), 20.0),),
              {"GMS observ.": {}}),
        Trial((force,), {"disturb. 100": {}, "disturb. 400": {"w": 400.0}}),
        Trial((law, force), {"both": {"scale_stribeck": 0.0}}),
    ]  # fmt: skip


def _levels(s: float) -> dict[str, float]:
    return {"scale_coulomb": s, "scale_stribeck": s}


def measure(quick: bool) -> Section:
    """The table: a row a case, two columns a plant."""
    known, ended = plants(quick), dict[str, str]()
    columns = {name: _column(name, law, ended) for name, law in known.items()}
    first = next(iter(columns.values()))
    rows: list[list[Cell]] = [
        [case, *(_cell(*column[case]) for column in columns.values())] for case in first
    ]
    goals = [
        goal
        for name, column in columns.items()
        for goal in (
            Goal(f"{name}: RMS error, times smaller", column[PROVEN][0], GOAL, ">="),
            Goal(f"{name}: hunting [counts]", column[PROVEN][1], 1.0),
        )
    ]
    return Section(
        "Compensators in C in a position loop (1 kg, 1 kHz, counts of 1 um, one sample late): "
        "times that the RMS error of a sine is smaller / hunting after a step [counts]",
        ["case", *known],
        rows,
        goals,
        _notes(ended),
    )


def _column(name: str, law: Law, ended: dict[str, str]) -> dict[str, tuple[float, float]]:
    """Case -> times smaller, counts of hunting; the first case is without compensation."""
    plant = drive(law, m=CONTROLLER.inertia, N=1.0)
    found: dict[str, tuple[float, float]] = {}
    for trial in trials():
        moving, resting = (
            close_loop(
                plant, reference, trial.blocks,
                controller=CONTROLLER, cases=trial.cases, noise=trial.noise,
            )
            for reference in (sine(0.02, 0.5, 6.0), step(0.01, 20.0))
        )  # fmt: skip
        for case in ("without", *trial.cases):
            hunting = resting[case].hunting / resting.count
            found[case] = moving.reduction(case), hunting
            if why := moving[case].ended or resting[case].ended:
                ended[f"{name}, {case}"] = why
    return found


def _cell(smaller: float, hunting: float) -> str:
    return f"{smaller:.3g} / {hunting:.4g}" if not hunting < 1e-3 else f"{smaller:.3g} / 0"


def _size() -> str:
    """What the C of the compensator costs on a small core."""
    whole, alone = on_core(trials()[0].blocks[0]), on_core(law_block(BELIEVED))
    if not whole.ok:
        return f"No instructions counted: {whole.status}"
    return (
        f"Cortex-M4F, float, guards: {whole.average:.0f} instructions a sample (LuGre alone "
        f"{alone.average:.0f}), text {whole.text:.0f} B, stack {whole.stack:.0f} B."
    )


def _notes(ended: Mapping[str, str]) -> list[str]:
    return [
        *(f"{case}: {why}" for case, why in ended.items()),
        _size(),
        "RMS: times smaller than without; hunts: to and fro in the last half of 20 s at rest.",
        "Believed: LuGre with half the stiffness of the plants; levels x s: both levels of it.",
        f"{PROVEN}: without the excess of break-away over sliding, the one beside the goals.",
        "its k = 0: LuGre moved by the measured velocity alone, as a law without a reference is.",
    ]
