"""Units beside `simulate`: how far they differ, what a communication step costs, how large."""

import tempfile
from collections.abc import Callable, Mapping
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from time import perf_counter
from typing import final

import numpy as np
from numpy.typing import NDArray

from symfric import BrownMcPhee, ExactCoulomb, Hold, Law, LuGre, SolveError, simulate
from symfric.bench.codegen_section import Cell, Goal, Section
from symfric.fmu import Exported, export_fmu
from symfric.fmu.running import running
from symfric.foundation.compiler import find_compiler
from symfric.integrator import Input
from symfric.scenes import ALL_SCENES, Scene

Array = NDArray[np.float64]
RTOL, STEP, TINY = 1e-9, 0.1, 1e-4
MOST = 10.0
"""Largest difference of a state, in rtol."""
LAWS: Mapping[str, Callable[[], Law]] = {
    "bm": BrownMcPhee,
    "lugre": LuGre,
    "exact": ExactCoulomb,
}
QUICK = ("rabinowicz", "drive", "pendulum")
TITLE = (
    f"FMI 3.0 co-simulation at rtol {RTOL:g}, communication step {STEP:g} s: kB; seconds of the "
    "compiler; largest difference of a state from simulate, in rtol of its size; attempts; us of a "
    f"communication step; us and attempts of one of {TINY:g} s; messages of FMPy's validator. bm "
    "is Brown and McPhee's law, exact Coulomb's by modes"
)
HEAD = ("scene, law", "kB", "cc", "rtol", "attempts", "us", "tiny", "a tiny", "fmpy")


@final
class _UnfinishedError(Exception):
    """A scene that `simulate` does not finish either."""


def measure(quick: bool) -> Section:
    """A row for every scene and law that `simulate` finishes; `quick` leaves most out."""
    if find_compiler() is None:
        return Section(TITLE, HEAD, (), notes=("found no C compiler ($CC, gcc, clang or cc)",))
    rows: list[list[Cell]] = []
    goals: list[Goal] = []
    left: list[str] = []
    for scene in QUICK if quick else ALL_SCENES:
        for law, make in LAWS.items():
            name = f"{scene} {law}"
            try:
                row, worst, said = _row(ALL_SCENES[scene](make()))
            except _UnfinishedError:
                left.append(name)
                continue
            rows.append([name, *row, said if isinstance(said, str) else float(said)])
            if law != "exact":
                goals.append(Goal(f"{name}: difference [rtol]", worst, MOST))
            if not isinstance(said, str):
                goals.append(Goal(f"{name}: messages of FMPy", float(said), 0.0))
    notes = [f"simulate itself does not finish {', '.join(left)}"] if left else []
    if find_spec("fmpy") is None:
        notes.append("FMPy's validator did not look: pip install fmpy")
    return Section(TITLE, HEAD, rows, goals, notes)


def _row(scene: Scene) -> tuple[list[Cell], float, str | int]:
    """Numbers of a unit, its largest difference in rtol, and messages of the validator."""
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
        # an event at a communication point, or at the start, happens in the step behind it
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
    """States at `times`, attempts, and seconds of a communication step."""
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
    """Seconds and attempts of a tiny communication step, of many over a tenth of a second."""
    count = round(0.1 / TINY)
    with running(unit.path) as one:
        begin = perf_counter()
        for _ in range(count):
            one.step(TINY)
        spent = perf_counter() - begin
        return spent / count, float(one.get(["attempts"])[0]) / count


def _validated(unit: Exported) -> str | int:
    """Number of messages of FMPy's validator, or a dash."""
    if find_spec("fmpy") is None:
        return "-"
    return len(import_module("fmpy.validation").validate_fmu(str(unit.path)))
