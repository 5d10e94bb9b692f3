"""Bank of scenes for the calibration of verdicts: right models, imperfect records, wrong models.

A scene draws a motion and noise from a seed and returns the fit of a user. Forces follow from the
imposed motion in closed form, F_e = m v' + F(v) + offset; bristles take exact steps on a grid ten
times finer than the record. `kept` scenes were written before the limits of the verdict and never
used to set them.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any, NamedTuple, final

import casadi as ca
import numpy as np
from numpy.random import Generator

from identification import Dataset, Fit, InverseDynamics, Points, Shooting
from symfric import law_from_text
from symfric.foundation.numeric import Array
from symfric.foundation.parameters import with_values
from symfric.integrator import Linear, Trajectory, simulate
from symfric.laws import Law, LuGre, SteadyStateLuGre, Stribeck
from symfric.model import Model
from symfric.scenes import Drive

M, OFFSET = 95.0, -3.0
"""Mass [kg] and constant force [N] of the stage."""
CURVE = {"mu_s": 28.0, "mu_d": 20.0, "v_s": 0.01, "sigma_2": 200.0}
HIDDEN = CURVE | {"v_s": 1e-3}
PLAIN = {"mu_d": 20.0, "sigma_2": 200.0}
STAGE = {"m": M, "offset": OFFSET}
BRISTLE = {"sigma_0": 1e5, "sigma_1": 300.0}
SPEED, SECONDS, RATE, FINE = 0.08, 12.0, 500.0, 10
"""Largest speed [m/s], length [s] and sampling rate [1/s] of a record; fine steps per sample."""
NOISE, FINEST = 0.5, 1e-9
"""Standard deviations of the noise of a force [N] and of a nearly exact position [m]."""


@final
@dataclass(frozen=True)
class Scene:
    """Experiment with known parameters.

    Attributes:
        name: name of the scene.
        kind: "right": model and record are right, the fit must be called solved; "record": the
            model is right, the record is not, and the fit may be called doubtful; "wrong": no fit
            of the model may be called solved.
        fit: function of a random generator that returns the fit.
        truth: parameter -> true value.
        kept: True if the scene was never used to set a limit.
    """

    name: str
    kind: str
    fit: Callable[[Generator], Fit]
    truth: Mapping[str, float]
    kept: bool = False


class Motion(NamedTuple):
    """Times, positions, velocities and accelerations, each of shape (n,)."""

    t: Array
    x: Array
    v: Array
    a: Array

    def sampled(self) -> "Motion":
        """Return every sample of the record, without the fine steps between them."""
        return Motion(*(part[::FINE] for part in self))


def motion(
    rng: Generator, top: float = SPEED, least: float = 0.05, one_way: bool = False,
    fast: float = 1.0,
) -> Motion:  # fmt: skip
    """Return strokes of three frequencies with random phases, slow at first and at the end.

    Args:
        rng: generator of the phases.
        top: largest speed [m/s].
        least: share of the speed at first and at the end.
        one_way: motion in one direction.
        fast: factor of the frequencies.
    """
    t = np.arange(round(SECONDS * RATE) * FINE + 1) / (RATE * FINE)
    waves = zip((0.2, 0.45, 0.8), (1.0, 0.6, 0.3), rng.uniform(0, 2 * np.pi, 3), strict=True)
    v = sum((a * np.sin(2 * np.pi * fast * f * t + p) for f, a, p in waves), np.zeros(t.size))
    v = v * (least + (1 - least) * np.sin(np.pi * t / t[-1]) ** 2)
    v = np.abs(v) + 0.02 if one_way else v
    v *= top / np.abs(v).max()
    h = t[1]
    x = np.concatenate([[0.0], np.cumsum(h * (v[1:] + v[:-1]) / 2)])
    return Motion(t, x, v, np.gradient(v, t))


def curve(v: Array, mu_s: float, mu_d: float, v_s: float, sigma_2: float) -> Array:
    """Return friction with a Stribeck peak."""
    return np.sign(v) * (mu_d + (mu_s - mu_d) * np.exp(-((v / v_s) ** 2))) + sigma_2 * v


def plain(v: Array, mu_d: float, sigma_2: float) -> Array:
    """Return Coulomb and viscous friction."""
    return mu_d * np.sign(v) + sigma_2 * v


def bristle(t: Array, v: Array, z: float = 0.0, sigma_0: float = 1e5, sigma_1: float = 300.0,
            mu_s: float = 28.0, mu_d: float = 20.0, v_s: float = 0.01, sigma_2: float = 200.0
            ) -> Array:  # fmt: skip
    """Return the friction of LuGre from the bristle deflection z [m], by exact steps."""
    h, mean = np.diff(t), (v[1:] + v[:-1]) / 2
    level = (mu_d + (mu_s - mu_d) * np.exp(-((mean / v_s) ** 2))) / sigma_0
    decay = np.exp(-np.abs(mean) / level * h)
    path = [z]
    for keep, end in zip(decay.tolist(), (np.sign(mean) * level).tolist(), strict=True):
        path.append(end + (path[-1] - end) * keep)
    bent = np.array(path)
    level = (mu_d + (mu_s - mu_d) * np.exp(-((v / v_s) ** 2))) / sigma_0
    return sigma_0 * bent + sigma_1 * (v - np.abs(v) / level * bent) + sigma_2 * v


def ar(rng: Generator, n: int, rho: float, size: float) -> Array:
    """Return stationary AR(1) noise of standard deviation `size`."""
    e = rng.standard_normal(n)
    for k in range(1, n):
        e[k] = rho * e[k - 1] + np.sqrt(1 - rho**2) * e[k]
    return size * e


Change = Callable[[Generator, Motion, Array], tuple[Array, Array]]
"""Function of generator, motion and exact force that returns recorded positions and forces."""


def exact(rng: Generator, m: Motion, F: Array) -> tuple[Array, Array]:
    """Return the record without further errors."""
    del rng
    return m.x, F


def stage(
    rng: Generator, *, law: str = "stribeck", friction: Callable[[Array], Array] | None = None,
    change: Change = exact, noise: float = NOISE, rho: float = 0.0, position: float = 1e-7,
    bristles: bool = False, given: Mapping[str, Any] | None = None, **moves: Any,
) -> Fit:  # fmt: skip
    """Return the fit of a stage by inverse dynamics.

    Args:
        rng: generator of motion and noise.
        law: fitted law.
        friction: true friction over velocity; None: with a Stribeck peak.
        change: further errors of the record.
        noise, rho: standard deviation [N] and correlation from sample to sample of the force noise.
        position: standard deviation of the white noise of positions [m].
        bristles: the true friction is that of LuGre.
        given: further arguments of the fit.
        moves: arguments of `motion`.
    """
    whole = motion(rng, **moves)
    m, of_v = whole.sampled(), partial(curve, **CURVE) if friction is None else friction
    rubbed = bristle(whole.t, whole.v)[::FINE] if bristles else of_v(m.v)
    noisy = M * m.a + rubbed + OFFSET + ar(rng, m.t.size, rho, noise)
    x, force = change(rng, m, noisy)
    data = Dataset.of(t=m.t, x=x + position * rng.standard_normal(x.size), force=force)
    return Fit(InverseDynamics(), law, data, **(given or {}))


def points(
    rng: Generator, *, law: Any = "stribeck", friction: Callable[[Array], Array] | None = None,
    count: int = 80, low: float = 1e-3, noise: float = NOISE, kind: Any = None, **given: Any,
) -> Fit:  # fmt: skip
    """Return the fit of a friction curve through means at constant speeds of both directions."""
    speeds = np.geomspace(low, SPEED, count // 2)
    v = np.concatenate([-speeds[::-1], speeds])
    F = (partial(curve, **CURVE) if friction is None else friction)(v)
    data = Dataset.of(v=v, F=F + noise * rng.standard_normal(v.size), points=True)
    return Fit(kind or Points(), law, data, **given)


def memory(
    rng: Generator, *, start: float = 0.0, noise: float = 0.3, position: float = 0.0,
    creeping: bool = False,
) -> Fit:  # fmt: skip
    """Return the fit of LuGre to forces under an imposed motion with reversals.

    Args:
        rng: generator of motion and noise.
        start: deflection of the bristles at the first sample, relative to mu_s / sigma_0.
        noise, position: standard deviations of the noise of force [N] and position [m]; the
            velocity is the derivative of the noisy position.
        creeping: only the stiffness is unknown, in slow motion.
    """
    whole = motion(rng, 2e-3 if creeping else 0.03, 0.0)
    F = bristle(whole.t, whole.v, start * CURVE["mu_s"] / BRISTLE["sigma_0"])[::FINE]
    m = whole.sampled()
    v = m.v
    if position:
        v = np.gradient(m.x + position * rng.standard_normal(m.x.size), m.t)
    data = Dataset.of(t=m.t, v=v, F=F + noise * rng.standard_normal(F.size))
    fixed = CURVE | {"sigma_1": BRISTLE["sigma_1"]} if creeping else None
    return Fit(Points(), LuGre(**CURVE, **BRISTLE), data, free=["sigma_0"], fixed=fixed)


T = np.linspace(0.0, 4.0, 201)
U = 3 * np.sin(2 * np.pi * 0.7 * T) + 2 * np.sin(2 * np.pi * 1.9 * T + 1)
"""Times [s] and forces [N] of the block that is simulated."""
BLOCK = {"m": 2.0, "mu_d": 1.0, "sigma_2": 0.8}


def block(law: Law) -> Model:
    """Return a block under a force."""
    return Drive(with_values(law, {"mu_d": 1.0, "sigma_2": 0.8}), m=2.0, N=1.0).model(free=[*BLOCK])


@cache
def simulated(law: Law, spring: float = 0.0) -> Trajectory:
    """Return the motion of a block, with a spring of stiffness `spring` [N/m]."""
    model, u = block(law), {"force": Linear(T, U)}
    if spring and model.ode is not None:
        pull = spring / BLOCK["m"] * model.x[0].symbol
        model = replace(model, ode=model.ode - ca.vertcat(0, pull))
    return simulate(model, 4.0, p=BLOCK, t_eval=T, u=u, x0={"x": 0.0, "v": 0.0}, rtol=1e-9)


PEAK = Stribeck(mu_s=1.4, v_s=0.1, v_eps=1e-4)
COULOMB_LAW = law_from_text("coulomb+viscous")


def shooting(rng: Generator, law: Law = COULOMB_LAW, rho: float = 0.0, spring: float = 0.0) -> Fit:
    """Return the fit of Coulomb and viscous friction to the simulated motion of a block."""
    x = simulated(law, spring)["x"] + ar(rng, T.size, rho, 1e-4)
    data, start = Dataset.of(t=T, x=x, force=U), {"m": 1.7, "mu_d": 0.8, "sigma_2": 1.0}
    return Fit(Shooting(), block(COULOMB_LAW), data, start=start, starts=1)


# ---- errors of records and of models ----


def encoder(step: float) -> Change:
    """Return the rounding of positions to multiples of `step` [m]."""

    def change(rng: Generator, m: Motion, F: Array) -> tuple[Array, Array]:
        return step * np.round((m.x + step * rng.uniform()) / step), F

    return change


def jitter(rng: Generator, m: Motion, F: Array) -> tuple[Array, Array]:
    """Return positions at times that scatter by 0.3 ms."""
    return np.interp(m.t + 3e-4 * rng.standard_normal(m.t.size), m.t, m.x), F


def delay(rng: Generator, m: Motion, F: Array, late: float = 2e-3) -> tuple[Array, Array]:
    """Return forces that are `late` [s]."""
    del rng
    return m.x, np.interp(m.t - late, m.t, F)


def backlash(rng: Generator, m: Motion, F: Array, play: float = 2e-5) -> tuple[Array, Array]:
    """Return positions of an encoder that follows the stage with a play [m]."""
    del rng
    path = [m.x[0]]
    for x in m.x[1:].tolist():
        path.append(min(max(path[-1], x - play / 2), x + play / 2))
    return np.array(path), F


def saturated(rng: Generator, m: Motion, F: Array) -> tuple[Array, Array]:
    """Return forces of a sensor that loses 10 % of the gain at the largest force."""
    del rng
    return m.x, F * (1 - 0.1 * (F / np.abs(F).max()) ** 2)


def loaded(rng: Generator, m: Motion, F: Array) -> tuple[Array, Array]:
    """Return forces of a guide that rubs with 5 % of the force of inertia."""
    del rng
    return m.x, F + 0.05 * M * np.abs(m.a) * np.sign(m.v)


def drift(rng: Generator, m: Motion, F: Array) -> tuple[Array, Array]:
    """Return forces whose viscous part falls by 30 % over time, and the Coulomb level by 10 %."""
    del rng
    share = m.t / m.t[-1]
    return m.x, F - share * (0.3 * CURVE["sigma_2"] * m.v + 0.1 * CURVE["mu_d"] * np.sign(m.v))


def warm_up(rng: Generator, m: Motion, F: Array) -> tuple[Array, Array]:
    """Return forces whose viscous part falls by 30 % with the dissipated energy."""
    del rng
    heat = np.cumsum(np.abs(m.v))
    return m.x, F - 0.3 * (1 - np.exp(-3 * heat / heat[-1])) * CURVE["sigma_2"] * m.v


def uneven(rng: Generator, m: Motion, F: Array) -> tuple[Array, Array]:
    """Return forces with a Coulomb level that varies by 6 % over the position."""
    way = 2 * np.pi * (m.x / 0.05 + rng.uniform())
    return m.x, F + 0.06 * CURVE["mu_d"] * np.sign(m.v) * np.sin(way)


def cogging(rng: Generator, m: Motion, F: Array) -> tuple[Array, Array]:
    """Return forces with a ripple of 2 N over the position."""
    return m.x, F + 2.0 * np.sin(2 * np.pi * (m.x / 0.01 + rng.uniform()))


def clipped(rng: Generator, m: Motion, F: Array) -> tuple[Array, Array]:
    """Return forces limited to 80 % of the largest one."""
    del rng
    most = 0.8 * np.abs(F).max()
    return m.x, np.clip(F, -most, most)


def held(rng: Generator, m: Motion, F: Array) -> tuple[Array, Array]:
    """Return forces of which the logger stores every fourth one four times."""
    del rng
    return m.x, F[4 * (np.arange(F.size) // 4)]


def gained(rng: Generator, m: Motion, F: Array) -> tuple[Array, Array]:
    """Return forces of a sensor with a gain of 1.05 in one direction."""
    del rng
    return m.x, np.where(F > 0, 1.05, 1.0) * F


def heavy_tails(rng: Generator, m: Motion, F: Array) -> tuple[Array, Array]:
    """Return forces with noise of Student's t distribution with four degrees of freedom."""
    return m.x, F + 0.3 * rng.standard_t(4, F.size)


def asymmetric(v: Array) -> Array:
    """Return Coulomb and viscous friction, a tenth larger in one direction."""
    return plain(v, **PLAIN) * np.where(v > 0, 1.1, 1.0)


def quadratic(v: Array) -> Array:
    """Return Coulomb and viscous friction with a drag of 10 N at the largest speed."""
    return plain(v, **PLAIN) + 10.0 * v * np.abs(v) / SPEED**2


def root(v: Array) -> Array:
    """Return Coulomb friction and a drag that grows with the square root of the speed."""
    return np.sign(v) * (20.0 + 16.0 * np.sqrt(np.abs(v) / SPEED))


STRIBECK = STAGE | CURVE
COULOMB = STAGE | PLAIN
flat = partial(plain, **PLAIN)
fine = partial(stage, position=FINEST)
simple = partial(fine, law="coulomb+viscous", friction=flat, position=FINEST)
"""Stage with Coulomb and viscous friction, truly and in the model."""

SCENES = (
    Scene("curve, coulomb+viscous", "right",
          partial(points, law="coulomb+viscous", friction=flat), PLAIN),
    Scene("curve, stribeck", "right", points, CURVE),
    Scene("stage, coulomb+viscous", "right", simple, COULOMB),
    Scene("stage, coulomb+viscous, AR(1) 0.9", "right", partial(simple, rho=0.9), COULOMB),
    Scene("stage, stribeck", "right", fine, STRIBECK),
    Scene("stage, stribeck, AR(1) 0.9", "right", partial(fine, rho=0.9), STRIBECK),
    Scene("stage, no peak, stribeck fitted", "right", partial(fine, friction=flat), COULOMB),
    Scene("stage, peak hardly in the data", "right",
          partial(fine, friction=partial(curve, **HIDDEN), noise=2.0), STAGE | HIDDEN),
    Scene("bristles", "right", memory, BRISTLE),
    Scene("creeping bristles", "right", partial(memory, creeping=True),
          {"sigma_0": BRISTLE["sigma_0"]}),
    Scene("shooting", "right", shooting, BLOCK),
    Scene("shooting, AR(1) 0.6", "right", partial(shooting, rho=0.6), BLOCK),
    Scene("shooting, AR(1) 0.9", "record", partial(shooting, rho=0.9), BLOCK),
    Scene("stage, position noise 0.1 um", "record", stage, STRIBECK),
    Scene("stage, position noise 1 um", "record", partial(stage, position=1e-6), STRIBECK),
    Scene("stage, position noise 5 um", "record", partial(stage, position=5e-6), STRIBECK),
    Scene("stage, encoder 5 um", "record", partial(stage, position=0.0, change=encoder(5e-6)),
          STRIBECK),
    Scene("stage, encoder 20 um", "record", partial(stage, position=0.0, change=encoder(2e-5)),
          STRIBECK),
    Scene("stage, jitter 0.3 ms", "record", partial(stage, change=jitter), STRIBECK),
    Scene("stage, delay 2 ms", "record", partial(stage, change=delay), STRIBECK),
    Scene("stage, clipped force", "record", partial(stage, change=clipped), STRIBECK),
    Scene("stage, one direction", "record", partial(stage, one_way=True), STRIBECK),
    Scene("bristles, position noise 0.2 um", "record",
          partial(memory, creeping=True, position=2e-7), {"sigma_0": BRISTLE["sigma_0"]}),
    Scene("bristles, loaded start", "record", partial(memory, start=0.9), BRISTLE),
    Scene("stage, drift in time", "wrong", partial(fine, change=drift), STRIBECK),
    Scene("stage, warming up", "wrong", partial(fine, change=warm_up), STRIBECK),
    Scene("stage, uneven track", "wrong", partial(fine, change=uneven), STRIBECK),
    Scene("stage, cogging", "wrong", partial(fine, change=cogging), STRIBECK),
    Scene("stage, wrong mass", "wrong", partial(fine, given={"fixed": {"m": 0.95 * M}}), STRIBECK),
    Scene("stage, no peak in the model", "wrong", partial(fine, law="coulomb+viscous"), COULOMB),
    Scene("stage, bristles as coulomb+viscous", "wrong",
          partial(fine, law="coulomb+viscous", bristles=True), COULOMB),
    Scene("stage, asymmetric", "wrong", partial(simple, friction=asymmetric), COULOMB),
    Scene("curve, quadratic drag", "wrong",
          partial(points, law="coulomb+viscous", friction=quadratic), PLAIN),
    Scene("curve, exponent not in the data", "right",
          partial(points, law=SteadyStateLuGre(), friction=flat, free=["delta"]),
          {"sigma_2": CURVE["sigma_2"]}),
    Scene("shooting, no peak in the model", "wrong", partial(shooting, law=PEAK), BLOCK),
    Scene("kept: stage, heavy tails", "right", partial(simple, change=heavy_tails), COULOMB, True),
    Scene("kept: stage, asymmetric law", "right",
          partial(simple, law="asymmetric(coulomb+viscous)", friction=asymmetric, rho=0.5),
          {"m": M, "mu_d_pos": 22.0 + OFFSET, "mu_d_neg": 20.0 - OFFSET, "sigma_2_pos": 220.0,
           "sigma_2_neg": 200.0},
          True),
    Scene("kept: curve of few points", "right", partial(points, count=30), CURVE, True),
    Scene("stage, held force", "record", partial(fine, change=held), STRIBECK),
    Scene("kept: stage, encoder 1 um, AR(1) 0.7", "record",
          partial(stage, position=0.0, change=encoder(1e-6), rho=0.7), STRIBECK, True),
    Scene("stage, one-sided gain", "wrong", partial(simple, change=gained), COULOMB),
    Scene("kept: stage, root of the speed", "wrong", partial(simple, friction=root), COULOMB, True),
    Scene("kept: stage, warming up, coulomb+viscous", "wrong", partial(simple, change=warm_up),
          COULOMB, True),
    Scene("kept: shooting, missing spring", "wrong", partial(shooting, spring=0.5), BLOCK, True),
    Scene("kept: stage, delay 1 ms, AR(1) 0.7", "record",
          partial(stage, change=partial(delay, late=1e-3), rho=0.7), STRIBECK, True),
    Scene("kept: bristles, position noise 1 um", "record", partial(memory, position=1e-6), BRISTLE,
          True),
    Scene("kept: stage, backlash of the encoder", "record", partial(stage, change=backlash),
          STRIBECK, True),
    Scene("kept: stage, saturating sensor", "wrong", partial(simple, change=saturated), COULOMB,
          True),
    Scene("kept: stage, friction of the guide under load", "wrong", partial(simple, change=loaded),
          COULOMB, True),
)  # fmt: skip
