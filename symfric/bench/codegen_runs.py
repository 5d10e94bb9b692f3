"""Generated code at run time: FMUs compared with `simulate`, compensators in a control loop."""

import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from time import perf_counter
from typing import final

import numpy as np
from numpy.typing import NDArray

from symfric import BrownMcPhee, ExactCoulomb, Hold, Law, LuGre, SolveError, simulate
from symfric.bench.table import Cell, Goal, Table
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
from symfric.fmu import Exported, export_fmu
from symfric.fmu.export import running
from symfric.foundation.programs import find_compiler
from symfric.integrator import Input
from symfric.laws import GMS, ElastoPlastic
from symfric.laws.dynamic.maxwell_slip import Element
from symfric.scenes import ALL_SCENES, Scene, drive

Array = NDArray[np.float64]
RTOL, STEP, TINY = 1e-9, 0.1, 1e-4
MOST = 10.0
"""Goal for the largest difference of a state [rtol]."""
LAWS: Mapping[str, Callable[[], Law]] = {
    "bm": BrownMcPhee,
    "lugre": LuGre,
    "exact": ExactCoulomb,
}
QUICK = ("rabinowicz", "drive", "pendulum")
UNIT_TABLE = Table(
    f"FMI 3.0 co-simulation at rtol {RTOL:g}, communication step {STEP:g} s; largest difference of "
    "a state from `simulate`, relative to its largest value. Laws: bm: Brown-McPhee, exact: "
    "Coulomb with events",
    ("scene, law", "size [kB]", "compile time [s]", "largest difference [rtol]", "attempts",
     "time per step [us]", f"time per step of {TINY:g} s [us]", f"attempts per step of {TINY:g} s",
     "messages of FMPy's validator"),
    (),
    ("scene, law", "kB", "cc", "rtol", "attempts", "us", "tiny", "a tiny", "fmpy"),
)  # fmt: skip


@final
class _UnfinishedError(Exception):
    """Error for a scene that `simulate` does not finish either."""


def units(quick: bool) -> Table:
    """Measure every scene and law that `simulate` finishes; `quick`: three scenes."""
    if find_compiler() is None:
        return replace(UNIT_TABLE, notes=("found no C compiler ($CC, gcc, clang or cc)",))
    rows: list[list[Cell]] = []
    goals: list[Goal] = []
    left: list[str] = []
    for scene in QUICK if quick else ALL_SCENES:
        for law, make in LAWS.items():
            name = f"{scene} {law}"
            try:
                row, worst, messages = _unit_row(ALL_SCENES[scene](make()))
            except _UnfinishedError:
                left.append(name)
                continue
            rows.append([name, *row, messages if isinstance(messages, str) else float(messages)])
            if law != "exact":
                goals.append(Goal(f"{name}: difference [rtol]", worst, MOST))
            if not isinstance(messages, str):
                goals.append(Goal(f"{name}: messages of FMPy", float(messages), 0.0))
    notes = [f"simulate itself does not finish {', '.join(left)}"] if left else []
    if find_spec("fmpy") is None:
        notes.append("FMPy's validator was not run: pip install fmpy")
    return replace(UNIT_TABLE, rows=rows, goals=goals, notes=notes)


def _unit_row(scene: Scene) -> tuple[list[Cell], float, str | int]:
    """Return the cells of an FMU, its largest difference [rtol], and messages of the validator."""
    with tempfile.TemporaryDirectory() as folder:
        times: Array = STEP * np.arange(round(scene.t_end / STEP) + 1, dtype=float)
        unit = export_fmu(scene, Path(folder) / "unit.fmu", rtol=RTOL, t_end=float(times[-1]))
        tuned = [e.name for e in unit.variables if e.causality == "parameter"][:-1]
        model = scene.model(tuned)
        given = {v.name: 2.0 * np.sin(np.pi * times) for v in model.u}
        held: dict[str, Input] = {name: Hold(times, values) for name, values in given.items()}
        try:
            same = simulate(model, float(times[-1]), t_eval=times, rtol=RTOL, u=held)
        except SolveError as error:
            raise _UnfinishedError from error
        # an event at a communication point, or at the start, occurs in the step after it
        names = [v.name for v in model.x if not v.name.endswith("mode")]
        found, attempts, each = _stepped(unit, names, times, given)
        worst = max(
            float(np.abs(column - same[name])[1:].max() / np.abs(same[name]).max())
            for name, column in zip(names, found.T, strict=True)
            if np.abs(same[name]).max() > 0
        )
        tiny, spent = _tiny(unit)
        row: list[Cell] = [
            round(unit.size / 1024), round(unit.times[1], 1), round(worst / RTOL, 3), attempts,
            round(1e6 * each), round(1e6 * tiny, 1), round(spent, 3),
        ]  # fmt: skip
        return row, worst / RTOL, _validated(unit)


def _stepped(
    unit: Exported, names: list[str], times: Array, given: Mapping[str, Array]
) -> tuple[Array, float, float]:
    """Return states at `times`, attempts, and time of a communication step [s]."""
    rows: list[Array] = []
    with running(unit.path, **{name: float(values[0]) for name, values in given.items()}) as one:
        rows.append(one.get(names))
        begin = perf_counter()
        for k in range(times.size - 1):
            if given:
                one.set({name: float(values[k]) for name, values in given.items()})
            one.step(float(times[k + 1] - times[k]))
            rows.append(one.get(names))
        return np.array(rows), float(one.get(["attempts"])[0]), (perf_counter() - begin) / len(rows)


def _tiny(unit: Exported) -> tuple[float, float]:
    """Return mean time [s] and attempts of tiny communication steps over a tenth of a second."""
    count = round(0.1 / TINY)
    with running(unit.path) as one:
        begin = perf_counter()
        for _ in range(count):
            one.step(TINY)
        spent = perf_counter() - begin
        return spent / count, float(one.get(["attempts"])[0]) / count


def _validated(unit: Exported) -> str | int:
    """Return the number of messages of FMPy's validator, or a dash."""
    if find_spec("fmpy") is None:
        return "-"
    return len(import_module("fmpy.validation").validate_fmu(str(unit.path)))


CURVE = {"mu_s": 6.0, "mu_d": 4.0, "v_s": 5e-3, "sigma_2": 20.0}
"""Coefficients of friction; with N = 1 N they are forces in newtons."""
BELIEVED = LuGre(sigma_0=1e5, sigma_1=300.0, **CURVE)
SPRINGS = tuple(Element(k, 0.25) for k in (1.5e5, 7.5e4, 4.5e4, 3e4))
SOFTER = tuple(Element(element.k / 2, element.alpha) for element in SPRINGS)
CONTROLLER = Cascade(kp=20.0, kv=60.0, ki=10.0)
GOAL = 5.0
"""Goal for the reduction factor of the RMS error."""
PROVEN = "excess 0"
"""Case whose numbers have goals."""


@final
@dataclass(frozen=True, eq=False)
class Trial:
    """Blocks that act together, with their cases."""

    blocks: tuple[Block, ...]
    cases: Mapping[str, Mapping[str, float]]
    noise: float = 0.0


def plants(quick: bool) -> dict[str, Law]:
    """Return the friction laws of the plants; those with events take longer."""
    found: dict[str, Law] = {
        "LuGre": LuGre(sigma_0=2e5, sigma_1=400.0, **CURVE),
        "elasto": ElastoPlastic(sigma_0=2e5, sigma_1=400.0, **CURVE),
    }
    if not quick:
        found["GMS"] = GMS(elements=SPRINGS, C=400.0, form="event", **CURVE)
        found["Coulomb"] = ExactCoulomb(form="stribeck", **CURVE)
    return found


def trials() -> list[Trial]:
    """Return LuGre compensators with exact and wrong parameters, observers, and combinations."""
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


def compensation(quick: bool) -> Table:
    """Measure every case on every plant."""
    known, ended = plants(quick), dict[str, str]()
    columns = {name: _column(name, law, ended) for name, law in known.items()}
    first = next(iter(columns.values()))
    rows: list[list[Cell]] = [
        [case, *(_compensated(*column[case]) for column in columns.values())] for case in first
    ]
    goals = [
        goal
        for name, column in columns.items()
        for goal in (
            Goal(f"{name}: reduction of the RMS error [1]", column[PROVEN][0], GOAL, ">="),
            Goal(f"{name}: hunting [counts]", column[PROVEN][1], 1.0),
        )
    ]
    return Table(
        "Compensators in C in a position loop (1 kg, 1 kHz, counts of 1 um, delay of one sample): "
        "reduction factor of the RMS error of a sine / hunting after a step [counts]",
        ["case", *known],
        rows,
        goals=goals,
        notes=_notes(ended),
    )


def _column(name: str, law: Law, ended: dict[str, str]) -> dict[str, tuple[float, float]]:
    """Return case -> (reduction factor, hunting [counts]); the first case has no compensation."""
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


def _compensated(smaller: float, hunting: float) -> str:
    return f"{smaller:.3g} / {hunting:.4g}" if not hunting < 1e-3 else f"{smaller:.3g} / 0"


def _size() -> str:
    """Describe the cost of the compensator's C on a small core."""
    whole, alone = on_core(trials()[0].blocks[0]), on_core(law_block(BELIEVED))
    if not whole.ok:
        return f"No instructions counted: {whole.status}"
    return (
        f"Cortex-M4F, float, guards: {whole.average:.0f} instructions per sample (LuGre alone "
        f"{alone.average:.0f}), text {whole.text:.0f} B, stack {whole.stack:.0f} B."
    )


def _notes(ended: Mapping[str, str]) -> list[str]:
    return [
        *(f"{case}: {why}" for case, why in ended.items()),
        _size(),
        "Hunting: peak-to-peak motion in the second half of 20 s at rest.",
        "Compensators use LuGre with half the stiffness of the plants; levels x s scales both "
        "levels of it.",
        f"{PROVEN}: without the excess of break-away over sliding friction; this case has goals.",
        "its k = 0: LuGre driven by the measured velocity alone, without correction.",
    ]
