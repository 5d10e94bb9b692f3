"""Calibration of verdicts over a bank of scenes: right models, imperfect records, wrong models.

A scene draws a motion and noise from a seed and returns the fit of a user. `kept` scenes were never
used to set a limit of the verdict.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import TYPE_CHECKING, Any, NamedTuple, final

import casadi as ca
import numpy as np
from numpy.random import Generator

from identification import Dataset, Fit, InverseDynamics, Points, Shooting
from symfric import Linear, Model, Status, Trajectory, law_from_text, simulate, with_values
from symfric.bench import identification_records as records
from symfric.bench.identification_records import BRISTLE, CURVE, FINEST, OFFSET, PLAIN, STAGE, M
from symfric.bench.report import Found, Row, goal, timed
from symfric.foundation.numeric import Array
from symfric.laws import Law, LuGre, SteadyStateLuGre, Stribeck
from symfric.scenes import Drive

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@final
@dataclass(frozen=True)
class Setup:
    """Scene: an experiment with known parameters.

    Attributes:
        name: name of the scene.
        kind: "right": model and record are right, the fit must be called solved; "record": the
            model is right, the record is not, and the fit may be called doubtful; "wrong": no fit
            of the model may be called solved.
        fit: function of a random generator that returns the fit.
        truth: parameter -> true value.
    """

    name: str
    kind: str
    fit: Callable[[Generator], Fit]
    truth: Mapping[str, float]

    @property
    def kept(self) -> bool:
        """True if the scene was never used to set a limit."""
        return self.name.startswith("kept")


def stage(
    rng: Generator, *, law: str = "stribeck", friction: Callable[[Array], Array] | None = None,
    seen: records.Seen | None = None, felt: str = "", noise: float = records.NOISE,
    rho: float = 0.0, position: float = 1e-7, bristles: bool = False,
    given: Mapping[str, Any] | None = None, **moves: Any,
) -> Fit:  # fmt: skip
    """Return the fit of a stage by inverse dynamics.

    Args:
        rng: generator of motion and noise.
        law: fitted law.
        friction: true friction over velocity; None: with a Stribeck peak.
        seen: errors of the recorded positions.
        felt: errors of the recorded forces, a name of `FELT`.
        noise, rho: standard deviation [N] and correlation from sample to sample of the force noise.
        position: standard deviation of the white noise of positions [m].
        bristles: the true friction is that of LuGre.
        given: further arguments of the fit.
        moves: arguments of `motion`.
    """
    whole = records.motion(rng, **moves)
    m, of_v = whole.sampled(), friction or partial(records.curve, **CURVE)
    rubbed = records.bristle(whole.t, whole.v)[:: records.FINE] if bristles else of_v(m.v)
    noisy = M * m.a + rubbed + OFFSET + records.ar(rng, m.t.size, rho, noise)
    force = records.FELT[felt](rng, m, noisy) if felt else noisy
    x = seen(rng, m) if seen else m.x
    data = Dataset.of(t=m.t, x=x + position * rng.standard_normal(x.size), force=force)
    return Fit(InverseDynamics(), law, data, **(given or {}))


def points(
    rng: Generator, *, law: Any = "stribeck", friction: Callable[[Array], Array] | None = None,
    count: int = 80, **given: Any,
) -> Fit:  # fmt: skip
    """Return the fit of a friction curve through means at constant speeds of both directions."""
    speeds = np.geomspace(1e-3, records.SPEED, count // 2)
    v = np.concatenate([-speeds[::-1], speeds])
    F = (partial(records.curve, **CURVE) if friction is None else friction)(v)
    data = Dataset.of(v=v, F=F + records.NOISE * rng.standard_normal(v.size), points=True)
    return Fit(Points(), law, data, **given)


def memory(
    rng: Generator, *, start: float = 0.0, position: float = 0.0, creeping: bool = False
) -> Fit:
    """Return the fit of LuGre to forces under an imposed motion with reversals.

    Args:
        rng: generator of motion and noise.
        start: deflection of the bristles at the first sample, relative to mu_s / sigma_0.
        position: standard deviation of the noise of the position [m], whose derivative is the
            velocity.
        creeping: only the stiffness is unknown, in slow motion.
    """
    whole = records.motion(rng, 2e-3 if creeping else 0.03, 0.0)
    z = start * CURVE["mu_s"] / BRISTLE["sigma_0"]
    F = records.bristle(whole.t, whole.v, z)[:: records.FINE]
    m = whole.sampled()
    v = m.v
    if position:
        v = np.gradient(m.x + position * rng.standard_normal(m.x.size), m.t)
    data = Dataset.of(t=m.t, v=v, F=F + 0.3 * rng.standard_normal(F.size))
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
    x = simulated(law, spring)["x"] + records.ar(rng, T.size, rho, 1e-4)
    data, start = Dataset.of(t=T, x=x, force=U), {"m": 1.7, "mu_d": 0.8, "sigma_2": 1.0}
    return Fit(Shooting(), block(COULOMB_LAW), data, start=start, starts=1)


STRIBECK = STAGE | CURVE
COULOMB = STAGE | PLAIN
flat = partial(records.plain, **PLAIN)
fine = partial(stage, position=FINEST)
simple = partial(fine, law="coulomb+viscous", friction=flat, position=FINEST)
"""Stage with Coulomb and viscous friction, truly and in the model."""

SCENES = (
    Setup("curve, coulomb+viscous", "right", partial(points, law="coulomb+viscous", friction=flat),
          PLAIN),
    Setup("curve, stribeck", "right", points, CURVE),
    Setup("stage, coulomb+viscous", "right", simple, COULOMB),
    Setup("stage, coulomb+viscous, AR(1) 0.9", "right", partial(simple, rho=0.9), COULOMB),
    Setup("stage, stribeck", "right", fine, STRIBECK),
    Setup("stage, stribeck, AR(1) 0.9", "right", partial(fine, rho=0.9), STRIBECK),
    Setup("stage, no peak, stribeck fitted", "right", partial(fine, friction=flat), COULOMB),
    Setup("stage, peak hardly in the data", "right",
          partial(fine, friction=partial(records.curve, **records.HIDDEN), noise=2.0),
          STAGE | records.HIDDEN),
    Setup("bristles", "right", memory, BRISTLE),
    Setup("creeping bristles", "right", partial(memory, creeping=True),
          {"sigma_0": BRISTLE["sigma_0"]}),
    Setup("shooting", "right", shooting, BLOCK),
    Setup("shooting, AR(1) 0.6", "right", partial(shooting, rho=0.6), BLOCK),
    Setup("shooting, AR(1) 0.9", "record", partial(shooting, rho=0.9), BLOCK),
    Setup("stage, position noise 0.1 um", "record", stage, STRIBECK),
    Setup("stage, position noise 1 um", "record", partial(stage, position=1e-6), STRIBECK),
    Setup("stage, position noise 5 um", "record", partial(stage, position=5e-6), STRIBECK),
    Setup("stage, encoder 5 um", "record",
          partial(stage, position=0.0, seen=records.encoder(5e-6)), STRIBECK),
    Setup("stage, encoder 20 um", "record",
          partial(stage, position=0.0, seen=records.encoder(2e-5)), STRIBECK),
    Setup("stage, jitter 0.3 ms", "record", partial(stage, seen=records.jitter), STRIBECK),
    Setup("stage, delay 2 ms", "record", partial(stage, felt="2 ms late"), STRIBECK),
    Setup("stage, clipped force", "record", partial(stage, felt="limited to 80 %"), STRIBECK),
    Setup("stage, one direction", "record", partial(stage, one_way=True), STRIBECK),
    Setup("bristles, position noise 0.2 um", "record",
          partial(memory, creeping=True, position=2e-7), {"sigma_0": BRISTLE["sigma_0"]}),
    Setup("bristles, loaded start", "record", partial(memory, start=0.9), BRISTLE),
    Setup("stage, drift in time", "wrong", partial(fine, felt="friction falls"), STRIBECK),
    Setup("stage, warming up", "wrong", partial(fine, felt="warms up"), STRIBECK),
    Setup("stage, uneven track", "wrong", partial(fine, felt="level varies by 6 %"), STRIBECK),
    Setup("stage, cogging", "wrong", partial(fine, felt="cogging of 2 N"), STRIBECK),
    Setup("stage, wrong mass", "wrong", partial(fine, given={"fixed": {"m": 0.95 * M}}), STRIBECK),
    Setup("stage, no peak in the model", "wrong", partial(fine, law="coulomb+viscous"), COULOMB),
    Setup("stage, bristles as coulomb+viscous", "wrong",
          partial(fine, law="coulomb+viscous", bristles=True), COULOMB),
    Setup("stage, asymmetric", "wrong", partial(simple, friction=records.asymmetric), COULOMB),
    Setup("curve, quadratic drag", "wrong",
          partial(points, law="coulomb+viscous", friction=records.quadratic), PLAIN),
    Setup("curve, exponent not in the data", "right",
          partial(points, law=SteadyStateLuGre(), friction=flat, free=["delta"]),
          {"sigma_2": CURVE["sigma_2"]}),
    Setup("shooting, no peak in the model", "wrong", partial(shooting, law=PEAK), BLOCK),
    Setup("kept: stage, heavy tails", "right", partial(simple, felt="heavy tails"),
          COULOMB),
    Setup("kept: stage, asymmetric law", "right",
          partial(simple, law="asymmetric(coulomb+viscous)", friction=records.asymmetric, rho=0.5),
          {"m": M, "mu_d_pos": 22.0 + OFFSET, "mu_d_neg": 20.0 - OFFSET, "sigma_2_pos": 220.0,
          "sigma_2_neg": 200.0}),
    Setup("kept: curve of few points", "right", partial(points, count=30), CURVE),
    Setup("stage, held force", "record", partial(fine, felt="held four times"), STRIBECK),
    Setup("kept: stage, encoder 1 um, AR(1) 0.7", "record",
          partial(stage, position=0.0, seen=records.encoder(1e-6), rho=0.7), STRIBECK),
    Setup("stage, one-sided gain", "wrong", partial(simple, felt="one-sided gain"), COULOMB),
    Setup("kept: stage, root of the speed", "wrong", partial(simple, friction=records.root),
          COULOMB),
    Setup("kept: stage, warming up, coulomb+viscous", "wrong",
          partial(simple, felt="warms up"), COULOMB),
    Setup("kept: shooting, missing spring", "wrong", partial(shooting, spring=0.5), BLOCK),
    Setup("kept: stage, delay 1 ms, AR(1) 0.7", "record",
          partial(stage, felt="1 ms late", rho=0.7), STRIBECK),
    Setup("kept: bristles, position noise 1 um", "record", partial(memory, position=1e-6), BRISTLE),
    Setup("kept: stage, backlash of the encoder", "record",
          partial(stage, seen=lambda rng, m: records.with_play(m.x, 2e-5)), STRIBECK),
    Setup("kept: stage, saturating sensor", "wrong", partial(simple, felt="gain falls by 10 %"),
          COULOMB),
    Setup("kept: stage, friction of the guide under load", "wrong",
          partial(simple, felt="rubs with 5 % of inertia"), COULOMB),
)  # fmt: skip


SEEDS, EVERY = 50, 6
"""Number of seeds; quick runs fit every sixth scene once, without goals."""
TITLE = "Verdicts and coverage of 95 % intervals"
INSIDE = (0.90, 0.99)
"""Range of the coverage of the intervals of fits that are called solved."""
ENOUGH = 10
"""Smallest number of intervals whose coverage counts."""
RIGHT, WRONG = 0.90, 0.05
"""Smallest share of right models, and largest share of wrong models, that are called solved."""
WIDTH = 1.96
"""Standard errors of a measured coverage within which it agrees with the range."""


class Count(NamedTuple):
    """Statuses of the fits of a scene, and coverage of the intervals of the solved ones.

    Attributes:
        scene: the scene.
        statuses: name of a status -> number of fits.
        covered: parameter -> intervals that contain the truth, and number of intervals.
    """

    scene: Setup
    statuses: Counter[str]
    covered: dict[str, tuple[int, int]]

    @property
    def solved(self) -> float:
        """Share of the fits that are called solved."""
        return self.statuses[Status.SOLVED.name] / self.statuses.total()

    def off(self) -> Iterator[tuple[str, float]]:
        """Yield each parameter whose coverage is significantly outside the range."""
        low, high = INSIDE
        for name, (inside, n) in self.covered.items():
            if n >= ENOUGH:
                below, above = (WIDTH * np.sqrt(p * (1 - p) / n) for p in INSIDE)
                share = inside / n
                if share < low - below or share > high + above:
                    yield name, share


def counted(scene: Setup, seeds: Sequence[int]) -> Count:
    """Fit a scene with each of `seeds`."""
    statuses, covered = Counter[str](), dict[str, tuple[int, int]]()
    number = SCENES.index(scene)
    for seed in seeds:
        found = scene.fit(np.random.default_rng([seed, number])).solve(throw=False)
        statuses[found.status.name] += 1
        for name, true in scene.truth.items():
            e = found.parameters[name]
            if found.status is Status.SOLVED and e.low is not None and e.high is not None:
                inside, n = covered.get(name, (0, 0))
                covered[name] = inside + (e.low <= true <= e.high), n + 1
    return Count(scene, statuses, covered)


def verdicts(quick: bool) -> Iterator[Found]:
    """Measure verdicts and coverage over all `SCENES`.

    Goals: the coverage of the 95 % intervals of all parameters of fits called solved is between
    .90 and .99 (within the error of the measured coverage), right models are called solved in 90 %,
    wrong ones in at most 5 %.
    """
    all_of, spent = list[Count](), 0.0
    for scene in SCENES[:: EVERY if quick else 1]:
        seconds, count = timed(partial(counted, scene, range(1 if quick else SEEDS)))
        all_of.append(count)
        spent += seconds
        yield TITLE, _row(count)
    if quick:
        return
    kinds = {k: [c for c in all_of if c.scene.kind == k] for k in ("right", "record", "wrong")}
    lost = [c for c in kinds["right"] if c.solved < RIGHT]
    what, note = "scenes of right models solved in less than 90 %", _names(lost)
    yield goal(what, len(lost), 0, "<=", spent, note)
    lost = [c for c in kinds["wrong"] if c.solved > WRONG]
    yield goal("scenes of wrong models solved in more than 5 %", len(lost), 0, note=_names(lost))
    off = [f"{c.scene.name}: {n} {x:.2f}" for c in all_of for n, x in c.off()]
    yield goal("coverages outside .90 ... .99", len(off), 0, note="; ".join(off))


def _names(counts: Sequence[Count]) -> str:
    return ", ".join(f"{c.scene.name} {c.solved:.2f}" for c in counts)


def _row(count: Count) -> Row:
    """Return the table row of a scene."""
    shares = [inside / n for inside, n in count.covered.values()]
    each = ", ".join(f"{n} {i}/{k}" for n, (i, k) in count.covered.items())
    others = count.statuses.total() - count.statuses["SOLVED"] - count.statuses["DOUBTFUL"]
    return {
        "scene": count.scene.name, "kind": count.scene.kind + " (kept)" * count.scene.kept,
        "fits": float(count.statuses.total()), "solved": float(count.statuses["SOLVED"]),
        "doubtful": float(count.statuses["DOUBTFUL"]), "others": float(others),
        "least coverage": min(shares, default=float("nan")), "intervals with the truth": each,
    }  # fmt: skip


def draw(rows: Sequence[Row]) -> "Figure":
    """Draw the shares of solved fits, and the coverage over all parameters among them."""
    from symfric.foundation.panels import grid  # noqa: PLC0415  (slow to import)
    from symfric.foundation.style import colour  # noqa: PLC0415  (slow to import)

    figure, ((left, right),) = grid(1, 2, 10.0, 1.5 + 0.22 * len(rows), sharey=True)
    kinds = list(dict.fromkeys(str(row["kind"]).split()[0] for row in rows))
    for y, row in enumerate(rows):
        shade = colour(kinds.index(str(row["kind"]).split()[0]))
        left.barh(y, float(row["solved"]) / float(row["fits"]), color=shade)
        cells = str(row["intervals with the truth"])
        pairs = [cell.rsplit(" ", 1)[1].split("/") for cell in cells.split(", ") if cell]
        inside, n = (sum(int(pair[k]) for pair in pairs) for k in (0, 1))
        if n >= ENOUGH:
            right.plot(inside / n, y, "o", ms=4, color=shade)
    left.set_yticks(range(len(rows)), [str(row["scene"]) for row in rows], fontsize="x-small")
    left.invert_yaxis()
    left.set_xlabel("share of fits called solved")
    right.axvspan(*INSIDE, alpha=0.15)
    right.set_xlabel("coverage of 95 % intervals of solved fits")
    for k, kind in enumerate(kinds):
        left.barh([0], [0], color=colour(k), label=kind)
    left.legend(fontsize="small")
    return figure
