"""Generated code at run time: FMUs compared with `simulate`, compensators in a control loop."""

import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from time import perf_counter
from typing import final

import numpy as np
from numpy.typing import NDArray

from symfric import BrownMcPhee, ExactCoulomb, Hold, Law, LuGre, SolveError, simulate
from symfric.bench.report import Found, Row, goal
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
UNITS = (
    f"FMI 3.0 co-simulation at rtol {RTOL:g}, communication step {STEP:g} s; largest difference of "
    "a state from `simulate`, relative to its largest value. Laws: bm: Brown-McPhee, exact: "
    "Coulomb with events"
)
DIFFERENCE, MESSAGES = "largest difference [rtol]", "messages of FMPy's validator"


def units(quick: bool) -> Iterator[Found]:
    """Measure every scene and law that `simulate` finishes; with `quick`, three scenes."""
    if find_compiler() is None:
        yield "fmu: no C compiler found ($CC, gcc, clang or cc)"
        return
    for scene in QUICK if quick else ALL_SCENES:
        for law, make in LAWS.items():
            name = f"{scene} {law}"
            try:
                row = _unit(ALL_SCENES[scene](make()))
            except SolveError:
                yield f"fmu: simulate does not finish {name} either"
                continue
            yield UNITS, {"scene, law": name, **row}
            if law != "exact":
                yield goal(f"{name}: difference [rtol]", float(row[DIFFERENCE]), MOST)
            if row[MESSAGES] != "-":
                yield goal(f"{name}: messages of FMPy", float(row[MESSAGES]), 0.0)
    if find_spec("fmpy") is None:
        yield "fmu: FMPy's validator was not run: pip install fmpy"


def _unit(scene: Scene) -> Row:
    """Return the measurements of one FMU."""
    with tempfile.TemporaryDirectory() as folder:
        times: Array = STEP * np.arange(round(scene.t_end / STEP) + 1, dtype=float)
        unit = export_fmu(scene, Path(folder) / "unit.fmu", rtol=RTOL, t_end=float(times[-1]))
        tuned = [e.name for e in unit.variables if e.causality == "parameter"][:-1]
        model = scene.model(tuned)
        given = {v.name: 2.0 * np.sin(np.pi * times) for v in model.u}
        held: dict[str, Input] = {name: Hold(times, values) for name, values in given.items()}
        same = simulate(model, float(times[-1]), t_eval=times, rtol=RTOL, u=held)
        # an event at a communication point or at the start belongs to the following step
        names = [v.name for v in model.x if not v.name.endswith("mode")]
        found, attempts, each = _stepped(unit, names, times, given)
        worst = max(
            float(np.abs(column - same[name])[1:].max() / np.abs(same[name]).max())
            for name, column in zip(names, found.T, strict=True)
            if np.abs(same[name]).max() > 0
        )
        count = round(0.1 / TINY)
        with running(unit.path) as one:
            begin = perf_counter()
            for _ in range(count):
                one.step(TINY)
            tiny = (perf_counter() - begin) / count
            tiny_attempts = float(one.get(["attempts"])[0]) / count
        messages = "-"
        if find_spec("fmpy") is not None:
            messages = len(import_module("fmpy.validation").validate_fmu(str(unit.path)))
        return {
            "size [kB]": round(unit.size / 1024), "compile time [s]": unit.times[1],
            DIFFERENCE: worst / RTOL, "attempts": attempts, "time per step [us]": 1e6 * each,
            f"time per step of {TINY:g} s [us]": 1e6 * tiny,
            f"attempts per step of {TINY:g} s": tiny_attempts, MESSAGES: messages,
        }  # fmt: skip


def _stepped(
    unit: Exported, names: list[str], times: Array, given: Mapping[str, Array]
) -> tuple[Array, float, float]:
    """Return states at `times`, number of attempts, and run time of a communication step [s]."""
    rows: list[Array] = []
    with running(unit.path, **{name: float(values[0]) for name, values in given.items()}) as one:
        rows.append(one.get(names))
        begin = perf_counter()
        for k in range(times.size - 1):
            if given:
                one.set({name: float(values[k]) for name, values in given.items()})
            one.step(float(times[k + 1] - times[k]))
            rows.append(one.get(names))
        each = (perf_counter() - begin) / (times.size - 1)
        return np.array(rows), float(one.get(["attempts"])[0]), each


CURVE = {"mu_s": 6.0, "mu_d": 4.0, "v_s": 5e-3, "sigma_2": 20.0}
"""Coefficients of friction, which are forces in newtons because N = 1 N."""
BELIEVED = LuGre(sigma_0=1e5, sigma_1=300.0, **CURVE)
SPRINGS = tuple(Element(k, 0.25) for k in (1.5e5, 7.5e4, 4.5e4, 3e4))
SOFTER = tuple(Element(element.k / 2, element.alpha) for element in SPRINGS)
CONTROLLER = Cascade(kp=20.0, kv=60.0, ki=10.0)
GOAL = 5.0
"""Goal for the reduction factor of the RMS error."""
PROVEN = "excess 0"
"""Case whose numbers have goals."""
LOOPS = (
    "Compensators in C in a position loop (1 kg, 1 kHz, counts of 1 um, delay of one sample): "
    "reduction factor of the RMS error of a sine / hunting after a step [counts]"
)


@final
@dataclass(frozen=True, eq=False)
class Trial:
    """Blocks that act together, with their cases."""

    blocks: tuple[Block, ...]
    cases: Mapping[str, Mapping[str, float]]
    noise: float = 0.0


def plants(quick: bool) -> dict[str, Law]:
    """Return the friction laws of the plants; with `quick`, omit laws with events."""
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
    levels = {
        f"levels x {s:g}": {"scale_coulomb": s, "scale_stribeck": s} for s in (1.0, 0.5, 0.8, 1.2)
    }
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


def compensation(quick: bool) -> Iterator[Found]:
    """Measure every case on every plant; the first case has no compensation."""
    rows: dict[str, dict[str, str]] = {}
    for name, law in plants(quick).items():
        plant = drive(law, m=CONTROLLER.inertia, N=1.0)
        for trial in trials():
            moving, resting = (
                close_loop(
                    plant, reference, trial.blocks,
                    controller=CONTROLLER, cases=trial.cases, noise=trial.noise,
                )
                for reference in (sine(0.02, 0.5, 6.0), step(0.01, 20.0))
            )  # fmt: skip
            for case in ("without", *trial.cases):
                smaller = moving.reduction(case)
                hunting = resting[case].hunting / resting.count
                shown = f"{hunting:.4g}" if not hunting < 1e-3 else "0"
                rows.setdefault(case, {"case": case})[name] = f"{smaller:.3g} / {shown}"
                if why := moving[case].ended or resting[case].ended:
                    yield f"compensation: {name}, {case}: {why}"
                if case == PROVEN:
                    yield goal(f"{name}: reduction of the RMS error [1]", smaller, GOAL, ">=")
                    yield goal(f"{name}: hunting [counts]", hunting, 1.0)
    yield from ((LOOPS, row) for row in rows.values())
    yield from (f"compensation: {note}" for note in (_cost(), *NOTES))


def _cost() -> str:
    """Return a sentence on the cost of the C of the compensator on a small core."""
    both, alone = on_core(trials()[0].blocks[0]), on_core(law_block(BELIEVED))
    if not both.ok:
        return f"no instructions counted, {both.status}"
    return (
        f"Cortex-M4F, float, guards: {both.average:.0f} instructions per sample (LuGre alone "
        f"{alone.average:.0f}), text {both.text:.0f} B, stack {both.stack:.0f} B"
    )


NOTES = (
    "hunting is the peak-to-peak motion in the second half of 20 s at rest",
    "compensators use LuGre with half the stiffness of the plants; levels x s scales both levels "
    "of it",
    f"{PROVEN} is without the excess of break-away over sliding friction; this case has goals",
    "its k = 0 is LuGre driven by the measured velocity alone, without correction",
)
