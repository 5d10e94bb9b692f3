"""Bank of scenes for the calibration of verdicts: right models, imperfect records, wrong models.

A scene draws a motion and noise from a seed and returns the fit of a user. `kept` scenes were never
used to set a limit of the verdict.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.random import Generator

from identification import Dataset, Fit, InverseDynamics, Points, Shooting
from symfric import law_from_text
from symfric.bench.identification_records import (
    BRISTLE,
    CURVE,
    FINE,
    FINEST,
    HIDDEN,
    NOISE,
    OFFSET,
    PLAIN,
    SPEED,
    STAGE,
    Change,
    M,
    ar,
    asymmetric,
    backlash,
    bristle,
    clipped,
    cogging,
    curve,
    delay,
    drift,
    encoder,
    exact,
    gained,
    heavy_tails,
    held,
    jitter,
    loaded,
    motion,
    plain,
    quadratic,
    root,
    saturated,
    uneven,
    warm_up,
)
from symfric.foundation.numeric import Array
from symfric.foundation.parameters import with_values
from symfric.integrator import Linear, Trajectory, simulate
from symfric.laws import Law, LuGre, SteadyStateLuGre, Stribeck
from symfric.model import Model
from symfric.scenes import Drive


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
