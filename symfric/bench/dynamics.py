"""Long-run behaviour: closed forms, branches of a belt and a mechanism, AUTO-07p, long runs.

The belt has 1 kg, 1 N/m, 1 N and a force that falls from 1.5 N to 1 N over 0.2 m/s, with 0.1 N s/m.
Exact friction is the limit v_t -> 0 of the smooth one.
"""

import os
import shutil
import subprocess
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from scipy.optimize import brentq
from scipy.special import lambertw

from symfric import Model, Variable, contact, rabinowicz, simulate, simulate_many
from symfric.bench.dynamics_machines import KINDS, compared, crank
from symfric.bench.report import Found, Progress, Report, Row, goal
from symfric.dynamics import (
    Branch,
    continuation,
    describing_function,
    equilibrium,
    linearize,
    orbits_from,
    periodic_orbit,
)
from symfric.foundation.numeric import Array
from symfric.laws import Coulomb, ExactCoulomb, Law, LuGre, Stribeck

BRANCHES = "Branch of the belt from the Hopf point through the fold or grazing"
LEVELS = {"mu_s": 1.5, "mu_d": 1.0, "v_s": 0.2, "sigma_2": 0.1}
EXACT = ExactCoulomb(form="stribeck", **LEVELS)
GRAZING = 1.43549791
"""Speed of the belt [m/s] at which the sliding orbit with exact friction touches it."""
STEPS = {1e-2: 0.032, 1e-3: 0.033, 1e-4: 0.034}
"""Width v_t [m/s] -> longest step with which a branch has about 200 points."""
G = 9.81


def bench(quick: bool = False, progress: Progress = None) -> Report:
    """Measure all; with `quick`, two machines of each kind and the exact branch only."""
    tasks: dict[str, Callable[[], Iterator[Found]]] = {
        "stick-slip": partial(stick_slip, 2 if quick else 8),
        "Hopf speed": partial(hopf_speed, 2 if quick else 8),
        "grazing": grazing,
        "linear": linear,
        "belt, exact": partial(belt_branch, "exact", EXACT, 0.028),
    }
    for w in () if quick else STEPS:
        tasks[f"belt, {w:g}"] = partial(smooth_branch, w)
    if not quick:
        tasks |= {"belt, LuGre": partial(belt_branch, "LuGre", LuGre(**LEVELS), 0.03)}
        tasks |= {"slider-crank": mechanism_branch}
    for kind in KINDS:
        tasks[f"runs, {kind}"] = partial(compared, kind, range(2 if quick else 8))
    return Report().collect(tasks, progress)


# ---- closed forms ----


def stick_slip(seeds: int) -> Iterator[Found]:
    """Compare period and multipliers of the stick-slip of one mass without damping."""
    began, off, size = process_time(), 0.0, 0.0
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        m, k, v = rng.uniform(0.3, 3.0), rng.uniform(1.0, 30.0), rng.uniform(0.02, 0.3)
        mu_d = rng.uniform(0.05, 0.3)
        mu_s = mu_d * rng.uniform(1.2, 2.0)
        belt = rabinowicz(ExactCoulomb(mu_s=mu_s, mu_d=mu_d), m=m, k=k, v_belt=v)
        w, rise = np.sqrt(k / m), (mu_s - mu_d) * m * G
        period = 2 * rise / (k * v) + 2 / w * (np.pi - np.arctan(rise * w / (k * v)))
        run = simulate(belt, 5 * period, x0={"v": v, "x": 0.0})
        orbit = periodic_orbit(belt, run, rtol=1e-11)
        off = max(off, abs(orbit.period / period - 1))
        size = max(size, float(np.abs(orbit.multipliers).max()))
    seconds = process_time() - began
    yield goal("period of stick-slip, relative error", off, 1e-9, seconds=seconds)
    yield goal("multiplier of stick-slip next to 1, size", size, 1e-8)


def hopf_speed(seeds: int) -> Iterator[Found]:
    """Compare the Hopf speeds of a belt with falling friction: w exp(-2 w) = c^2, w = (v/v_s)^2."""
    began, off = process_time(), 0.0
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        v_s, drop = float(rng.uniform(0.05, 0.5)), float(rng.uniform(0.05, 0.2))
        # c = sigma_2 v_s / (2 drop N) < 0.43 for two speeds
        N, share = 2.0 * G, float(rng.uniform(0.05, 0.35))
        sigma = 2 * share * drop * N / v_s
        law = ExactCoulomb(mu_s=0.1 + drop, mu_d=0.1, v_s=v_s, sigma_2=sigma, form="stribeck")
        model = rabinowicz(law, m=2.0, k=float(rng.uniform(1, 50)), v_belt=v_s, free=["v_belt"])
        rest = continuation(equilibrium(model), "v_belt", (1e-3 * v_s, 4 * v_s))
        found = sorted(h.value for h in rest.located("Hopf"))
        w = [-0.5 * lambertw(-2 * share**2, branch).real for branch in (0, -1)]
        expected = v_s * np.sqrt(w)
        off = max(off, float(np.abs(np.array(found) / expected - 1).max()))
    seconds = process_time() - began
    yield goal("two Hopf speeds of the Stribeck belt, relative error", off, 1e-9, seconds=seconds)


def grazing() -> Iterator[Found]:
    """Compare the grazing of a belt with viscous friction, whose sliding motion is linear."""
    began, N, m, k, c = process_time(), 0.8 * G, 0.8, 2.1, 0.1
    model = rabinowicz(ExactCoulomb(sigma_2=c), free=["v_belt"])
    branch = continuation(periodic_orbit(model, simulate(model, 30.0)), "v_belt", (0.1, 0.6))
    decay = c / (2 * m)
    w = np.sqrt(k / m - decay**2)

    def miss(speed: float) -> float:
        """Return the next largest velocity of a motion that leaves the belt, minus its speed."""
        slope = (0.1 * N - 0.15 * N) / m
        b = (slope + decay * speed) / w
        angle = np.arctan2(w * b - decay * speed, w * speed + decay * b) + 2 * np.pi
        top = np.exp(-decay * angle / w) * (speed * np.cos(angle) + b * np.sin(angle))
        return float(top - speed)

    root: Any = brentq(miss, 0.3, 0.5, xtol=1e-13)
    off = abs(branch.located("grazing")[0].value - root)
    yield goal(
        "grazing of the viscous belt, error [m/s]", off, 1e-7, seconds=process_time() - began
    )


def linear() -> Iterator[Found]:
    """Compare the describing function of Coulomb and the eigenvalues of a quarter car."""
    V = np.geomspace(1e-6, 1e3, 10)
    found = describing_function(Coulomb(mu_d=0.3, v_eps=0.0), V, [1.0], N=50.0)
    off = float(np.abs(found.values[:, 0] * np.pi * V / (4 * 15.0) - 1).max())
    yield goal("describing function of Coulomb, relative error", off, 1e-10)
    a, b, c, d = (
        Variable(n, unit) for n, unit in zip("abcd", ("m", "m", "m/s", "m/s"), strict=True)
    )
    strut, tyre = 28900.0 * (b - a) + 2600.0 * (d - c), -920000.0 * b
    ode = ca.vertcat(c.symbol, d.symbol, strut / 240.0, (tyre - strut) / 40.0)
    car = Model("car", x=(a, b, c, d), ode=ode)
    A = np.zeros((4, 4))
    A[:2, 2:], pull = np.eye(2), np.array([-28900.0, 28900.0, -2600.0, 2600.0])
    A[2:] = pull / 240.0, -pull / 40.0 - np.array([0.0, 23000.0, 0.0, 0.0])
    own, expected = linearize(car, equilibrium(car)).eigenvalues, np.linalg.eigvals(A)
    off = max(float(np.abs(expected - s).min() / abs(s)) for s in own)
    yield goal("eigenvalues of the quarter car, relative error", off, 1e-12)


# ---- branches ----


def belt(law: Law) -> Model:
    """Return the belt with its speed as free parameter."""
    x, v = Variable("x", "m", start=1.2), Variable("v", "m/s")
    speed = Variable("v_b", "m/s", start=0.8)
    slip = contact("belt", law, v - speed, 1.0, {"v": speed.symbol}, F_e=-x.symbol)
    rates = ca.vertcat(v.symbol, -x - slip.force)
    return Model("belt", x=(x, v), p=(speed,), ode=rates, contacts=(slip,))


def followed(model: Model, step: float) -> tuple[Branch, float]:
    """Return the orbits from the upper Hopf point to v_b = 0.05 m/s, and their processor time [s].

    Code is compiled before.
    """
    rest = continuation(equilibrium(model), "v_b", (0.05, 0.9))
    hopf = rest.located("Hopf")[-1]
    orbits_from(rest, hopf, (0.3, 2.0), step=step)
    began = process_time()
    branch = orbits_from(rest, hopf, (0.05, 2.0), points=400, step=step)
    return branch, process_time() - began


def belt_branch(name: str, law: Law, step: float) -> Iterator[Found]:
    """Measure the branch of one law and compare its time with that of an ensemble."""
    model = belt(law)
    branch, seconds = followed(model, step)
    end = next(iter(branch.special))
    yield BRANCHES, _row("symfric", name, branch.values.size, end.value, branch.values[-1], seconds)
    for_200 = seconds * 200 / branch.values.size
    note = f"{branch.values.size} points in {seconds:.2g} s"
    yield goal(f"belt, {name}: time of 200 points [s]", for_200, 2.0, seconds=seconds, note=note)
    if name == "exact":
        off = abs(end.value - GRAZING)
        yield goal("belt, exact: grazing, error [m/s]", off, 1e-7)
    began, speeds = process_time(), np.linspace(0.05, 1.4, 200)
    for start in ({"x": 1.05, "v": 0.0}, {"x": 0.0, "v": speeds}):
        simulate_many(model, 200.0, p={"v_b": speeds}, x0=start, rtol=1e-8, workers=1)
    spent = process_time() - began
    note = "2 runs of 200 s at 200 speeds, rtol = 1e-8; without unstable orbits"
    yield goal(
        f"belt, {name}: time relative to runs", for_200 / spent, 0.1, seconds=spent, note=note
    )


def smooth_branch(width: float) -> Iterator[Found]:
    """Measure the branch of a smooth law in symfric and in AUTO-07p."""
    name = f"v_t = {width:g} m/s"
    branch, seconds = followed(belt(Stribeck(v_eps=width, **LEVELS)), STEPS[width])
    (fold,) = branch.located("fold")
    size = branch.values.size
    yield BRANCHES, _row("symfric", name, size, fold.value, branch.values[-1], seconds)
    note = f"{size} points in {seconds:.2g} s"
    time = seconds * 200 / size
    yield goal(f"belt, {name}: time of 200 points [s]", time, 2.0, seconds=seconds, note=note)
    if not installed():
        yield "AUTO-07p or gfortran is not installed: no rows of AUTO-07p"
        return
    other = belt_of_auto(width, 600, 100 if width > 2e-4 else 200)
    yield BRANCHES, _row("AUTO-07p", name, other.points, other.fold, other.last, other.seconds)
    yield goal(f"belt, {name}: fold, difference from AUTO-07p [m/s]",
               abs(fold.value - other.fold), 1e-7)  # fmt: skip


def _row(tool: str, law: str, points: int, turn: float, last: float, seconds: float) -> Row:
    return {
        "tool": tool, "friction": law, "points": float(points),
        "fold or grazing [m/s]": f"{turn:.10f}", "last speed [m/s]": f"{last:.4f}",
        "processor time [s]": seconds,
    }  # fmt: skip


def mechanism_branch() -> Iterator[Found]:
    """Measure 200 orbits of a driven slider-crank over the stiffness of its spring."""
    k = ca.SX.sym("k")
    machine = crank(np.random.default_rng(0), k)
    run = simulate(machine.model, machine.t_end, u=machine.u, rtol=1e-7)
    orbit = periodic_orbit(machine.model, run, u=machine.u, period=machine.period)
    began = process_time()
    branch = continuation(orbit, "k", (3.0, 6.0), points=200, step=0.01)
    seconds, size = process_time() - began, branch.values.size
    note = f"{size} points in {seconds:.2g} s"
    yield goal("slider-crank: time of 200 points [s]", seconds * 200 / size, 20.0, note=note)


# ---- the belt with smooth friction in AUTO-07p: equilibria, Hopf points, orbits, fold ----
#
#     x' = v,   v' = -x - tanh(r / v_t) (1 + 0.5 exp(-(r / 0.2)^2)) - 0.1 r,   r = v - v_b
#
# The program is compiled by gfortran with the object files of Debian's package `auto-07p`, and
# called with its files fort.2 (constants), fort.3 (start), fort.7 (branch) and fort.8 (solutions).

FOLDER = Path("/usr/lib/auto-07p/lib")
CONSTANTS = """
NDIM=2, IPS={ips}, IRS={start}, ILP=1, ICP=[{free}], NTST={mesh}, NCOL=4, IAD=3, ISP=2, ISW=1
NMX={points}, NPR=1000, MXBF=0, IID=2, ITMX=8, ITNW=5, NWTN=3, JAC=0
EPSL={eps}, EPSU={eps}, EPSS=1e-6, DS={step}, DSMIN=1e-7, DSMAX={longest}, IADS=1
UZSTOP={{1:[0.02,2.0]}}
"""
FOLD, HOPF = 5, 3
"""Types of special points of AUTO."""


class OfAuto(NamedTuple):
    """Results of AUTO.

    Attributes:
        fold: belt speed of the fold of the orbits [m/s]; NaN if it was not found.
        points: number of orbits.
        last: belt speed of the last orbit [m/s].
        seconds: processor time of both runs without compiling [s].
    """

    fold: float
    points: int
    last: float
    seconds: float


def installed() -> bool:
    """Return True if AUTO and a Fortran compiler are installed."""
    return FOLDER.is_dir() and shutil.which("gfortran") is not None


def belt_of_auto(width: float, points: int, mesh: int = 200) -> OfAuto:
    """Return the branches of the belt with the smoothing width v_t [m/s].

    Args:
        width: v_t.
        points: number of orbits.
        mesh: number of mesh intervals of an orbit.
    """
    with TemporaryDirectory() as name:
        folder = Path(name)
        source = Path(__file__).with_name("belt.f90").read_text("utf-8")
        number = f"{width:e}".replace("e-", "D-")
        (folder / "belt.f90").write_text(source.replace("WIDTH", number), "utf-8")
        objects = map(str, sorted(FOLDER.glob("*.o")))
        call = ["gfortran", "-fopenmp", "-O2", "belt.f90", *objects, "-o", "belt"]
        subprocess.run(call, cwd=folder, check=True, capture_output=True)
        rest, first = _run(folder, ips=1, start=0, free="1", step=-0.01, longest=0.02, points=300)
        hopf = rest[rest[:, 2] == HOPF]
        shutil.move(folder / "fort.8", folder / "fort.3")
        orbits, second = _run(
            folder, ips=2, start=int(hopf[0, 3]), free="1,11", step=0.01, longest=0.05,
            points=points, mesh=mesh, eps=1e-7,
        )  # fmt: skip
    folds = orbits[orbits[:, 2] == FOLD, 4]
    fold = float(folds[0]) if folds.size else np.nan
    return OfAuto(fold, len(orbits), float(orbits[-1, 4]), first + second)


def _run(
    folder: Path, *, mesh: int = 20, eps: float = 1e-10, **constants: object
) -> tuple[Array, float]:
    """Return the rows of fort.7 (branch, point, type, label, v_b, ...) and the processor time."""
    (folder / "fort.2").write_text(CONSTANTS.format(mesh=mesh, eps=eps, **constants), "utf-8")
    (folder / "fort.3").touch()
    before, threads = os.times(), {**os.environ, "OMP_NUM_THREADS": "1"}
    subprocess.run(["./belt"], cwd=folder, check=True, capture_output=True, env=threads)
    after = os.times()
    seconds = after.children_user + after.children_system
    seconds -= before.children_user + before.children_system
    lines = (folder / "fort.7").read_text("utf-8").splitlines()
    rows = [line.split()[:5] for line in lines if line.split()[0] != "0"]
    return np.array([[float(cell) for cell in row] for row in rows]), seconds
