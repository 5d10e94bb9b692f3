"""Measured machines: EMPS, a drive; the joints of an arm at low speed; every static law on EMPS."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import inf, nan, sqrt
from pathlib import Path
from time import process_time
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from identification.data.dataset import Dataset
from identification.data.record import Record
from identification.fit import Fit
from identification.residuals.closed_loop import ClosedLoop
from identification.residuals.initial import local, noise_of
from identification.residuals.inverse import InverseDynamics
from identification.residuals.points import Points
from identification.residuals.shooting import Shooting
from identification.residuals.shots import sampled_motion
from identification.result.fitted import Fitted
from symfric import GMS, Element, LuGre
from symfric.bench.table import Goal
from symfric.foundation.status import SolveError, Status
from symfric.laws import Law, law_from_text
from symfric.laws.catalogue import ALL_LAWS
from symfric.model import Model

Array = NDArray[np.float64]

EMPS = Path(__file__).parents[3] / "shared" / "data" / "EMPS"
ESTIMATION, VALIDATION = "DATA_EMPS.mat", "DATA_EMPS_PULSES.mat"
DIRECTIONS = ("coulomb+viscous", "asymmetric(coulomb+viscous)")
WIDTHS = {DIRECTIONS[0]: ["v_eps"], DIRECTIONS[1]: ["v_eps_pos", "v_eps_neg"]}
HALVES, ROUND = (12.42, 6.21, 3.105, 1.5525, 0.77625), (1.0, 2.0, 3.0, 4.0, 6.0, 12.0)
"""Windows to choose from [s]: halves, quarters ... of the record, and round numbers."""
SOME = slice(1, 4)
"""Those of either that a quick measurement takes."""
BLOCKS = 4
LEFT_OUT, TRIM = 20, 50
"""Samples left out of the open-loop error at the start, and of the others at both ends."""


@final
@dataclass(frozen=True, eq=False)
class Candidate:
    """A law and how it is fitted, with its error on data that were left out."""

    law: str
    free: Sequence[str] | None
    kind: Any
    error: float = inf

    def fit(self, data: Dataset) -> Fitted:
        """From one start, which is that of the data."""
        return Fit(self.kind, self.law, data, free=self.free, starts=1).solve(throw=False)


def best(candidates: Sequence[Candidate]) -> Candidate:
    """The one with the least error."""
    return min(candidates, key=lambda c: c.error)


# ---- closed loop


def closed_loop(data: Dataset) -> Candidate:
    """The law of least force error in the second half, fitted to the first."""
    first, second = data.split(0.5)
    found = list[Candidate]()
    for law in DIRECTIONS:
        for free in (None, WIDTHS[law]):
            candidate = Candidate(law, free, ClosedLoop())
            error = loop_errors(candidate.fit(first), second)["force"]
            found.append(replace(candidate, error=error))
    return best(found)


def loop_errors(fit: Fitted, data: Dataset) -> dict[str, float]:
    """Signal -> norm of the error over that of the signal [%], the ends left out."""
    if fit.live is None:
        return {"x": nan, "force": nan}
    residuals = ClosedLoop().prepare(fit.live.subject, data)
    found = residuals.at(np.array([fit.values[name] for name in residuals.names]))
    if isinstance(found, str):
        return {"x": inf, "force": inf}
    r, inside = found.r, slice(TRIM, -TRIM)
    return {
        c.signal: 100
        * float(np.linalg.norm(r[c.rows][inside]) / np.linalg.norm(c.measured[inside]))
        for c in residuals.channels
    }


# ---- open loop


def open_loop(
    data: Dataset, lengths: Sequence[float], laws: Sequence[str] = DIRECTIONS
) -> Candidate:
    """The law and window length that predict left-out blocks best."""
    found = list[Candidate]()
    for law in laws:
        for length in lengths:
            kind = Shooting(["x"], length, interpolation="hold", every=10, engine="sampled")
            candidate = Candidate(law, None, kind)
            found.append(replace(candidate, error=_left_out(candidate, data[0])))
    return best(found)


def _left_out(candidate: Candidate, record: Record) -> float:
    """Root mean square over blocks of the error of free runs [m]."""
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
    """Root mean square error [m] of the motion under the measured force alone, the start left out.

    The motion starts at the measured position, with the velocity of a cubic through those around.
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


# ---- rows


def emps(quick: bool) -> Iterator[Goal]:
    """Errors on the validation record, and what the engine takes.

    Source of data and measure: Janot, Gautier, Brunot, "Data set and reference models of EMPS",
    Nonlinear System Identification Benchmarks 2019. Everything is chosen on the estimation record:

    closed loop  each candidate law is fitted to position and force of the first half and judged by
                 the force of the second; the best is fitted to all. Without feedback nothing
                 drifts, and what decides is the width of the change of sign (1.5 mm/s): below it
                 the drive yields.
    open loop    laws and window lengths: fitted to three of four blocks, a candidate predicts the
                 fourth as the measured force alone drives it, from the measured start; the least
                 root mean square error decides. The force is held for a sample, as the amplifier
                 does.

    What was learnt about the open loop. Symmetric friction predicts left-out blocks to 2.9 mm at
    best, friction with two directions to 1.7-2.2 mm at every window length from 1 to 6 s: the
    direction matters, the length hardly. Neither does a Stribeck part, a quadratic one, a slope
    along the way or a 2.5 mm ripple (1.9-2.1 mm), though the residuals see the place; nor start
    values held at the data (1.8 mm), nor a mean over shifted windows (1.9 mm).

    On the other record these equally good candidates lie between 5.4 and 14 mm, the mean over
    shifted windows at 8 to 12 mm, because friction is another one there: fitted alike, in windows
    of 1 s, it is 1.1 N (3 %) larger at 0.1 m/s. Along the estimation record it falls by 0.3 N, as
    of a drive that warms up. An offset of 0.04 N moves the end by a millimetre. So the estimation
    record cannot say which candidate will be best there. The first list of lengths that was tried
    (round numbers) gave windows of 2 s and 5.8 mm; halves of the record, as
    `Shooting(windows="choose")` takes them, give 1.55 s, as good on left-out blocks (1.7 to 1.9 mm
    by how these begin), and 7.9 mm. Both rows are shown: the goal is not reached, and a number
    below it would be luck. The structure suffices: fitted to the pulses themselves it leaves 0.7
    mm.
    """
    if not (EMPS / VALIDATION).is_file():
        for what, goal in (("closed loop x [%]", 1.4e-3), ("closed loop force [%]", 4.65),
                           ("open loop [mm]", 5.5)):  # fmt: skip
            yield Goal(what, nan, goal, note="data absent (../shared/data/EMPS)")
        return
    data, other = (Dataset.read(str(EMPS / name)) for name in (ESTIMATION, VALIDATION))
    began = process_time()
    chosen = closed_loop(data)
    fit = chosen.fit(data)
    errors, seconds = loop_errors(fit, other), process_time() - began
    widths = ", widths fitted" if chosen.free else ""
    note = f"{chosen.law}{widths}: {chosen.error:.2f} % of the force in the half left out"
    yield Goal("closed loop x [%]", errors["x"], 1.4e-3, "<=", seconds, note)
    yield Goal("closed loop force [%]", errors["force"], 4.65, "<=", seconds, note)
    laws, some = (DIRECTIONS[1:], SOME) if quick else (DIRECTIONS, slice(None))
    rows = [
        _open_row("", data, other, HALVES[some], laws),
        _open_row(", round windows", data, other, ROUND[some], laws[-1:]),
    ]
    yield from rows
    neural = "open loop, neural record [mm]"
    yield replace(rows[0], what=neural, goal=2.64, seconds=0.0, note="stretch goal")
    yield _speed(data, DIRECTIONS[1])


def _open_row(
    what: str, data: Dataset, other: Dataset, lengths: Sequence[float], laws: Sequence[str]
) -> Goal:
    """Choose by `data`, judge by `other`."""
    began = process_time()
    chosen = open_loop(data, lengths, laws)
    value = 1e3 * free_run(chosen.fit(data).model, other[0])
    note = (
        f"{chosen.law} in windows of {chosen.kind.windows:g} s, {1e3 * chosen.error:.2f} mm on the "
        "blocks left out; the other record has 3 % more friction"
    )
    return Goal(f"open loop{what} [mm]", value, 5.5, "<=", process_time() - began, note)


def _speed(data: Dataset, law: str) -> Goal:
    """Processor time of all positions of the record with their derivatives."""
    asked = Fit(Shooting(["x"], engine="sampled"), law, data).prepared()
    residuals = replace(asked.task.residuals, substeps=1)  # type: ignore[type-var]
    values = asked.task.unknowns.values(asked.centre)
    residuals.at(values)
    times = list[float]()
    for _ in range(5):
        began = process_time()
        residuals.at(values)
        times.append(process_time() - began)
    note = f"{data.size} samples, {len(residuals.names)} unknowns, best of 5"
    return Goal("record and its derivatives [s]", min(times), 0.15, "<=", sum(times), note)


FRANKA = Path(__file__).resolve().parents[3] / "shared" / "data" / "franka_low_speed"
JOINTS = {3: ("q2", 0.148), 4: ("q7", 0.046)}
"""Case -> joint, goal [N m]."""
ELEMENTS = 3
THIN = 2
"""Every so many samples: the elements slip over more than one of them."""
GEARED = (
    "met only by parameters that the law refuses: mu_s below mu_d and sigma_2 below 0 leave .045"
)


def franka(quick: bool) -> Iterator[Goal]:
    """LuGre and GMS under the measured velocity, from the data's own starts; some 15 s in all.

    Measured at joints 2 and 7 with reversals (some 400 Hz); the paper that published them reports
    .280 and .260 N m for its LuGre and .077 and .035 for its neural network, trained on other
    motions.
    """
    del quick
    for case, (joint, goal) in JOINTS.items():
        path = FRANKA / f"case{case}_slow.csv"
        for name, law, free in _bristles():
            what = f"case {case}, {name}: RMSE of the second half [N m]"
            if not path.is_file():
                yield Goal(what, nan, goal, note=f"data absent ({path})")
                continue
            begun = process_time()
            value = _rest_error(path, joint, law, free)
            note = GEARED if (case, name) == (4, "LuGre") else ""
            yield Goal(what, value, goal, "<=", process_time() - begun, note)


def _bristles() -> Iterator[tuple[str, Law, list[str]]]:
    """Laws and what is free besides levels, viscous coefficient and Stribeck velocity."""
    yield "LuGre", LuGre(), ["delta"]
    elements = tuple(Element(1e3, 1 / ELEMENTS) for _ in range(ELEMENTS))
    stiffnesses = [f"k_{i + 1}" for i in range(ELEMENTS)]
    shares = [f"alpha_{i + 1}" for i in range(1, ELEMENTS)]
    free = ["delta", "C", *stiffnesses, *shares]
    yield f"GMS of {ELEMENTS}", GMS(elements=elements, form="event"), free


def halves(path: Path, joint: str) -> tuple[Dataset, Dataset]:
    """Friction and velocity; the velocity by differences of the encoder, which knows the path."""
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


BEST = "asymmetric(andersson)"
ENDED = (Status.SOLVED, Status.DOUBTFUL)


def laws(quick: bool) -> Iterator[Goal]:
    """The rows; `quick` takes every fourth law.

    Each law of the catalogue without states is fitted by inverse dynamics, as it is and with its
    own parameters for either direction. A law fits if its fit ends at a minimum that it stays at:
    status SOLVED or DOUBTFUL. The records have no licence and are no part of the package.
    """
    if not (EMPS / ESTIMATION).is_file():
        note = "data absent (../shared/data/EMPS)"
        yield Goal("laws that neither fit nor are refused", nan, 0.0, note=note)
        return
    data, begun = Dataset.read(EMPS / ESTIMATION), process_time()
    names = [n for n in static_laws() for n in (n, f"asymmetric({n})")][:: 4 if quick else 1]
    outcomes = {name: outcome(name, data) for name in names}
    seconds = process_time() - begun
    lost = [name for name, text in outcomes.items() if text not in ("fits", "refused")]
    note = f"of {len(names)}; refused: {sum(t == 'refused' for t in outcomes.values())}"
    note += "".join(f"; {name}: {outcomes[name]}" for name in lost)
    what = "laws that neither fit nor are refused"
    yield Goal(what, float(len(lost)), 0.0, "<=", seconds, note)
    begun = process_time()
    best = Fit(InverseDynamics(), BEST, data).solve(throw=False)
    (error,) = best.errors.values()
    took = process_time() - begun
    yield Goal(f"force error of {BEST} [%]", error.relative, 3.0, "<=", took)


def static_laws() -> list[str]:
    """Names of the laws without states that a text makes."""
    return [name for name in ALL_LAWS if not law_from_text(name).states]


def outcome(name: str, data: Dataset) -> str:
    """Fit a law: "fits", "refused", or the failure."""
    try:
        found = Fit(InverseDynamics(), name, data).solve(throw=False)
    except ValueError as error:
        return "refused" if "\n" not in str(error) else f"{error}"
    return "fits" if found.status in ENDED else f"{found.status.name}: {found.message}"
