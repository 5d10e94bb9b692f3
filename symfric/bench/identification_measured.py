"""Fits of measured machines: the drive EMPS, and joints of an arm at low speed."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from math import inf, nan, sqrt
from pathlib import Path
from time import process_time
from typing import Any, final

import numpy as np

from identification import ClosedLoop, Dataset, Fit, Fitted, Points, Record, Shooting
from identification.residuals.initial import local, noise_of
from identification.residuals.shots import sampled_motion
from symfric import GMS, Element, Law, LuGre, Model, SolveError
from symfric.bench.report import Found, Row, best_time, goal, timed

DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
EMPS = DATA / "EMPS"
ESTIMATION, VALIDATION = "DATA_EMPS.mat", "DATA_EMPS_PULSES.mat"
DIRECTIONS = ("coulomb+viscous", "asymmetric(coulomb+viscous)")
WIDTHS = {DIRECTIONS[0]: ["v_eps"], DIRECTIONS[1]: ["v_eps_pos", "v_eps_neg"]}
HALVES, ROUND = (12.42, 6.21, 3.105, 1.5525, 0.77625), (1.0, 2.0, 3.0, 4.0, 6.0, 12.0)
"""Candidate window lengths [s]: halves, quarters, ... of the record, and round numbers."""
BLOCKS = 4
LEFT_OUT, TRIM = 20, 50
"""Samples excluded from the open-loop error at the start, from closed-loop errors at both ends."""


@final
@dataclass(frozen=True, eq=False)
class Candidate:
    """Law and method of its fit, with the error on left-out data."""

    law: str
    free: Sequence[str] | None
    kind: Any
    error: float = inf

    def fit(self, data: Dataset) -> Fitted:
        """Return the fit of the law from one start, which is computed from the data."""
        return Fit(self.kind, self.law, data, free=self.free, starts=1).solve(throw=False)


def best(candidates: Iterator[Candidate], error: Callable[[Candidate], float]) -> Candidate:
    """Return the candidate with the smallest error."""
    return min((replace(c, error=error(c)) for c in candidates), key=lambda c: c.error)


def closed_loop(data: Dataset) -> Candidate:
    """Return the law that, fitted to the first half, has the least force error in the second."""
    first, second = data.split(0.5)
    every = (Candidate(law, free, ClosedLoop())
             for law in DIRECTIONS for free in (None, WIDTHS[law]))  # fmt: skip
    return best(every, lambda c: loop_errors(c.fit(first), second)["force"])


def loop_errors(fit: Fitted, data: Dataset) -> dict[str, float]:
    """Return signal -> norm of the error relative to that of the signal [%], without both ends."""
    if fit.live is None:
        return {"x": nan, "force": nan}
    residuals = ClosedLoop().prepare(fit.live.subject, data)
    found = residuals.at(np.array([fit.values[name] for name in residuals.names]))
    if isinstance(found, str):
        return {"x": inf, "force": inf}
    r, inside, norm = found.r, slice(TRIM, -TRIM), np.linalg.norm
    return {
        c.signal: 100 * float(norm(r[c.rows][inside]) / norm(c.measured[inside]))
        for c in residuals.channels
    }


def open_loop(
    data: Dataset, lengths: Sequence[float], laws: Sequence[str] = DIRECTIONS
) -> Candidate:
    """Return the law and window length that predict left-out blocks best."""
    kinds = [
        Shooting(["x"], length, interpolation="hold", every=10, engine="sampled")
        for length in lengths
    ]
    every = (Candidate(law, None, kind) for law in laws for kind in kinds)
    return best(every, partial(_left_out, data[0]))


def _left_out(record: Record, candidate: Candidate) -> float:
    """Return the root mean square over left-out blocks of the error of free runs [m]."""
    edges = np.linspace(0, record.size, BLOCKS + 1).astype(int)
    errors = list[float]()
    for a, b in pairwise(edges.tolist()):
        sides = [slice(0, a), slice(b, None)]
        rest = tuple(record.at(s) for s in sides if len(range(record.size)[s]))
        try:
            fit = candidate.fit(Dataset(rest, "rest"))
        except SolveError:
            return inf
        errors.append(free_run(fit.model, record, a, b))
    return sqrt(sum(e * e for e in errors) / BLOCKS)


def free_run(model: Model, record: Record, first: int = 0, end: int | None = None) -> float:
    """Return the root mean square error [m] of the motion under the measured force.

    The motion starts at the measured position, with the velocity of a cubic through neighbouring
    positions. The error excludes the first samples.
    """
    x, rows = record["x"], slice(first, end)
    begin = local(record.time, x, first, noise_of(x))
    p = np.array([float(v.start) for v in model.p])
    start = np.array([begin.value, begin.rate])
    motion = sampled_motion(
        model, record.time[rows], record["force"][rows], p, start, hold="held", substeps=4
    )
    if isinstance(motion, str):
        return inf
    error = motion.states[:, 0] - x[rows]
    return float(np.sqrt(np.mean(error[LEFT_OUT:] ** 2)))


def emps(quick: bool) -> Iterator[Found]:
    """Measure errors on the validation record of EMPS, and the time of the engine.

    With `quick`, only the closed loop.

    Source of data and measure: Janot, Gautier, Brunot, "Data set and reference models of EMPS",
    Nonlinear System Identification Benchmarks 2019. All choices use only the estimation record:

    closed loop  each candidate law is fitted to position and force of the first half and judged by
                 the force of the second half; the best law is fitted to the whole record. The
                 closed loop prevents drift. The width of the change of sign (1.5 mm/s) is decisive:
                 below it the drive yields.
    open loop    a candidate is a law and a window length. Fitted to three of four blocks, it
                 predicts the fourth block under the measured force, from the measured start; the
                 candidate with the smallest root mean square error is chosen. The force is constant
                 for a sample, as in the amplifier.

    In the open loop, symmetric friction predicts left-out blocks to 2.9 mm at best, friction with
    two directions to 1.7-2.2 mm at every window length from 1 to 6 s: the direction has a large
    influence, the length a small one. A Stribeck part, a quadratic part, a slope over the position
    or a 2.5 mm ripple has as little influence (1.9-2.1 mm), although residuals depend on the
    position; so do start values fixed at the data (1.8 mm) and a mean over shifted windows
    (1.9 mm).

    On the other record, these equally good candidates range from 5.4 to 14 mm, the mean over
    shifted windows from 8 to 12 mm, because the friction differs: in the same fit, with windows of
    1 s, it is 1.1 N (3 %) larger at 0.1 m/s. During the estimation record friction falls by 0.3 N,
    as in a drive that warms up. An offset of 0.04 N moves the end by a millimetre. Therefore the
    estimation record does not determine the best candidate for the other record. Round window
    lengths, which were tried first, select 2 s and give 5.8 mm; halves of the record, as in
    `Shooting(windows="choose")`, select 1.55 s, which is as good on left-out blocks (1.7 to 1.9 mm
    depending on their start), and give 7.9 mm. Both rows are shown: the goal is not reached, and a
    number below it would be accidental. The structure is sufficient: fitted to the pulses
    themselves, it leaves 0.7 mm.
    """
    if not (EMPS / VALIDATION).is_file():
        for what, limit in (("closed loop x [%]", 1.4e-3), ("closed loop force [%]", 4.65),
                            ("open loop [mm]", 5.5)):  # fmt: skip
            yield goal(what, nan, limit, note="data absent (../shared/data/EMPS)")
        return
    data, other = (Dataset.read(str(EMPS / name)) for name in (ESTIMATION, VALIDATION))

    def closed() -> tuple[Candidate, dict[str, float]]:
        chosen = closed_loop(data)
        return chosen, loop_errors(chosen.fit(data), other)

    seconds, (chosen, errors) = timed(closed)
    widths = ", widths fitted" if chosen.free else ""
    note = f"{chosen.law}{widths}: {chosen.error:.2f} % of the force in the half left out"
    yield goal("closed loop x [%]", errors["x"], 1.4e-3, "<=", seconds, note)
    yield goal("closed loop force [%]", errors["force"], 4.65, "<=", seconds, note)
    for what, lengths, candidates in (
        ()
        if quick
        else (
            ("open loop [mm]", HALVES, DIRECTIONS),
            ("open loop, round windows [mm]", ROUND, DIRECTIONS[1:]),
        )
    ):
        begin = process_time()
        chosen = open_loop(data, lengths, candidates)
        value = 1e3 * free_run(chosen.fit(data).model, other[0])
        note = (
            f"{chosen.law} in windows of {chosen.kind.windows:g} s, {1e3 * chosen.error:.2f} mm on "
            "the blocks left out; the other record has 3 % more friction"
        )
        yield goal(what, value, 5.5, "<=", process_time() - begin, note)
        if lengths == HALVES:
            yield goal("open loop, neural record [mm]", value, 2.64, note="stretch goal")
    yield _speed(data, DIRECTIONS[1])


def _speed(data: Dataset, law: str) -> tuple[str, Row]:
    """Measure the processor time of all positions of the record with their derivatives."""
    prepared = Fit(Shooting(["x"], engine="sampled"), law, data).prepared()
    residuals = replace(prepared.task.residuals, substeps=1)  # type: ignore[type-var]
    values = prepared.task.unknowns.values(prepared.centre)
    residuals.at(values)
    seconds, _ = best_time(partial(residuals.at, values), inf, most=5, clock=process_time)
    note = f"{data.size} samples, {len(residuals.names)} unknowns, best of 5"
    return goal("record and its derivatives [s]", seconds, 0.15, note=note)


FRANKA = DATA / "franka_low_speed"
JOINTS = {3: ("q2", 0.148), 4: ("q7", 0.046)}
"""Case -> joint, goal [N m]."""
ELEMENTS = 3
THIN = 2
"""Thinning factor of the samples; an element takes more than one sample to slip."""
GEARED = (
    "met only by parameters that the law refuses: mu_s below mu_d and sigma_2 below 0 leave .045"
)


def franka(quick: bool) -> Iterator[Found]:
    """Fit LuGre and GMS under the measured velocity from default starts; with `quick`, LuGre.

    The records are from joints 2 and 7 with reversals (about 400 Hz). The paper that published them
    reports .280 and .260 N m for its LuGre and .077 and .035 for its neural network, trained on
    other motions. Levels, viscous coefficient and Stribeck velocity are free as well.
    """
    elements = tuple(Element(1e3, 1 / ELEMENTS) for _ in range(ELEMENTS))
    of_elements = [f"k_{i + 1}" for i in range(ELEMENTS)]
    of_elements += [f"alpha_{i + 1}" for i in range(1, ELEMENTS)]
    laws: dict[str, tuple[Law, list[str]]] = {
        "LuGre": (LuGre(), ["delta"]),
        f"GMS of {ELEMENTS}": (GMS(elements=elements, form="event"), ["delta", "C", *of_elements]),
    }
    if quick:
        laws.popitem()
    for case, (joint, limit) in JOINTS.items():
        path = FRANKA / f"case{case}_slow.csv"
        for name, (law, free) in laws.items():
            what = f"case {case}, {name}: RMSE of the second half [N m]"
            if not path.is_file():
                yield goal(what, nan, limit, note=f"data absent ({path})")
                continue
            seconds, value = timed(partial(_rest_error, path, joint, law, free))
            note = GEARED if (case, name) == (4, "LuGre") else ""
            yield goal(what, value, limit, "<=", seconds, note)


def halves(path: Path, joint: str) -> tuple[Dataset, Dataset]:
    """Return both halves of a record, with the velocity as difference quotient of the encoder."""
    columns = {"t": "time", "x": joint, "F": f"{joint}_tau_J_compensate"}
    units = {"t": "s", "x": "rad", "F": "N m"}
    record = Dataset.read(path, columns=columns, units=units).thinned(THIN)[0]
    v = np.gradient(record["x"], record.time)
    si = {"v": "rad/s", "F": "N m"}
    return Dataset.of(t=record.time, v=v, F=record["F"], units=si, name=path.stem).split(0.5)


def _rest_error(path: Path, joint: str, law: Law, free: list[str]) -> float:
    first, rest = halves(path, joint)
    fit = Fit(Points(offset=True), law, first, free=free, starts=3, evaluations=120)
    found = fit.solve(throw=False).validate(rest)
    return max(error.rms for error in found.values())
