"""Random machines whose periodic orbits are compared with long runs."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from time import process_time
from typing import final

import casadi as ca
import numpy as np

from symfric import Model, SolveError, Variable, simulate
from symfric.bench.report import Found
from symfric.dynamics import PeriodicOrbit, periodic_orbit
from symfric.integrator import Input
from symfric.laws import BrownMcPhee, ExactCoulomb, Law, LuGre, Stribeck
from symfric.multibody import JointSpringDamper
from symfric.scenes import CoupledBlocks, SliderCrank, contact, rabinowicz

RUNS = "Periodic orbits of random machines against runs at rtol = 1e-11"
LONG = 1e-11
SAME = 1e-7
"""Largest relative difference of period and amplitude that counts as none."""
LEAST, MOST = 20, 200
"""Smallest and largest number of periods of a long run."""
G = 9.81


@final
@dataclass(frozen=True, eq=False)
class TimedMachine:
    """Machine with the time in which it settles roughly.

    Attributes:
        model: the model.
        t_end: time of the run that guesses the orbit [s].
        watched: state whose amplitude is compared.
        u: inputs.
        period: period of the inputs [s]; None for an oscillation without them.
    """

    model: Model
    t_end: float
    watched: str
    u: Mapping[str, Input] = field(default_factory=dict[str, Input])
    period: float | None = None


def law(rng: np.random.Generator, speed: float, least: float = 1.2) -> Law:
    """Return a law whose force falls from its static to its dynamic level around `speed` [m/s].

    The ratio of the levels is between `least` and `least` + 0.8.
    """
    mu_d = float(rng.uniform(0.05, 0.3))
    levels = {"mu_d": mu_d, "mu_s": mu_d * float(rng.uniform(least, least + 0.8))}
    levels |= {"v_s": speed * float(rng.uniform(0.5, 2.0))}
    kind = int(rng.integers(3))
    if kind == 0:
        return ExactCoulomb(form="stribeck", **levels)
    return LuGre(**levels) if kind == 1 else Stribeck(v_eps=1e-3 * speed, **levels)


def belt(rng: np.random.Generator) -> TimedMachine:
    """Return a block on a belt."""
    m, k, v = rng.uniform(0.3, 3.0), rng.uniform(1.0, 30.0), float(rng.uniform(0.02, 0.2))
    model = rabinowicz(law(rng, v), m=m, k=k, v_belt=v)
    return TimedMachine(model, 40 * 2 * np.pi * np.sqrt(m / k), "x")


def two_blocks(rng: np.random.Generator) -> TimedMachine:
    """Return two blocks on a belt with a spring between them."""
    v, k = float(rng.uniform(0.1, 0.4)), rng.uniform(1.0, 5.0, 3)
    springs = {"k_1": k[0], "k_2": k[1], "k_c": k[2]}
    scene = CoupledBlocks(law(rng, v), v_belt=v, start_2=float(rng.uniform(0.05, 0.2)), **springs)
    return TimedMachine(scene.model(), 150.0, "x_1")


def hunting(rng: np.random.Generator) -> TimedMachine:
    """Return a drive under PID control whose static friction is above the dynamic one."""
    k_p, k_d, k_i = rng.uniform(30, 100), rng.uniform(2, 5), rng.uniform(15, 40)
    x, v, e = Variable("x", "m", start=0.05), Variable("v", "m/s"), Variable("e", "m s")
    pull = -k_p * x - k_d * v - k_i * e
    guide = contact("guide", law(rng, 0.005, 2.2), v.symbol, G, {"v": 0.0}, F_e=pull)
    ode = ca.vertcat(v.symbol, pull - guide.force, x.symbol)
    return TimedMachine(Model("drive", x=(x, v, e), ode=ode, contacts=(guide,)), 200.0, "x")


def pendulum(rng: np.random.Generator) -> TimedMachine:
    """Return a pendulum on a shaft that turns (Froude's pendulum); its load is m g."""
    length, R = rng.uniform(0.2, 1.0), rng.uniform(0.02, 0.1)
    speed = float(rng.uniform(0.2, 1.0)) * R
    phi, w = Variable("phi", "rad"), Variable("w", "rad/s", start=0.1)
    pull = -G * ca.sin(phi.symbol) * length / R
    shaft = contact("shaft", law(rng, speed), R * w - speed, G, {"w": speed / R}, F_e=pull)
    ode = ca.vertcat(w.symbol, (pull - shaft.force) * R / length**2)
    model = Model("pendulum", x=(phi, w), ode=ode, contacts=(shaft,))
    return TimedMachine(model, 60 * 2 * np.pi * np.sqrt(length / G), "phi")


def crank(rng: np.random.Generator, stiffness: float | ca.SX | None = None) -> TimedMachine:
    """Return a slider-crank with a spring at its crank, moved by a periodic torque.

    With a symbol as its stiffness, the bearing has bristles.
    """
    own = (BrownMcPhee(), LuGre(), ExactCoulomb())[int(rng.integers(3))]
    own = own if stiffness is None else LuGre()
    mechanism = SliderCrank(own, omega=0.0, R=float(rng.uniform(0.01, 0.03))).mechanism()
    moment, top = mechanism.input("torque", "N m"), float(rng.uniform(2.0, 4.0))
    k = float(rng.uniform(3.0, 6.0)) if stiffness is None else stiffness
    damping = float(rng.uniform(0.2, 0.5))
    mechanism.force(
        JointSpringDamper("spring", "crank", stiffness=k, damping=damping, actuator=moment)
    )
    p = tuple(Variable("k", "N m/rad", start=4.0, symbol=k) for _ in "k" if isinstance(k, ca.SX))

    def torque(t: ca.SX) -> ca.SX:
        return ca.SX(top * ca.sin(2 * ca.pi * t))

    u: dict[str, Input] = {"torque": torque}
    return TimedMachine(mechanism.build(p=p), 30.0, "crank", u, 1.0)


KINDS: dict[str, Callable[[np.random.Generator], TimedMachine]] = {
    "belt": belt, "two blocks": two_blocks, "drive with PID": hunting,
    "pendulum with friction": pendulum, "slider-crank with a spring": crank,
}  # fmt: skip


def compared(kind: str, seeds: range) -> Iterator[Found]:
    """Yield the row of one kind of machine, and a sentence for each machine that differs."""
    began, same, worst = process_time(), 0, [0.0, 0.0]
    for seed in seeds:
        try:
            off = differences(KINDS[kind](np.random.default_rng(seed)))
        except (ValueError, SolveError) as error:
            yield f"{kind}, seed {seed}: {error}"
            continue
        if max(off) > SAME:
            yield f"{kind}, seed {seed}: period and amplitude differ by {off[0]:.2g}, {off[1]:.2g}"
        same += max(off) <= SAME
        worst = np.maximum(worst, off).tolist()
    yield RUNS, {
        "machine": kind, "number": float(len(seeds)), "same": float(same),
        "relative error of the period": worst[0], "of the amplitude": worst[1],
        "processor time [s]": process_time() - began,
    }  # fmt: skip


def differences(machine: TimedMachine) -> tuple[float, float]:
    """Return the relative differences of period and amplitude between orbit and long run.

    Raises:
        ValueError: no orbit, or the long run does not settle to a motion that the orbit calls
            stable.
    """
    model, u = machine.model, machine.u
    run = simulate(model, machine.t_end, u=u, rtol=1e-7)
    orbit = periodic_orbit(model, run, u=u, period=machine.period, rtol=1e-10)
    cycle = simulate(model, _time(machine, orbit), u=u, rtol=LONG).period(tolerance=1e-6)
    n = max(1, round(cycle.period / orbit.period))
    if orbit.stable is False:
        raise ValueError("the run settles, but the orbit is unstable")
    size = orbit.amplitude(machine.watched)
    off = cycle.amplitude(machine.watched) - size
    return abs(cycle.period / (n * orbit.period) - 1), abs(off / size)


def _time(machine: TimedMachine, orbit: PeriodicOrbit) -> float:
    """Return the time [s] after which deviations have decayed to 1e-10 by the multipliers."""
    largest = min(float(np.abs(orbit.multipliers).max(initial=0.0)), 1 - 1e-9)
    periods = np.log(1e-10) / np.log(max(largest, 1e-10))
    return 2 * machine.t_end + float(np.clip(periods, LEAST, MOST)) * orbit.period
