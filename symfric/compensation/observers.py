"""Observers of friction as blocks: states of a law, or the force by the motion of a mass."""

from collections.abc import Callable
from types import UnionType
from typing import TypeVar

import casadi as ca

from symfric.codegen import Block, law_block
from symfric.codegen.blocks.from_law import in_turning
from symfric.codegen.blocks.held_step import held_step
from symfric.codegen.blocks.variables import arranged, step_size
from symfric.compensation.compensator import without_end
from symfric.compensation.force import LEAST, LIMITED, Parts, finished, within_load
from symfric.foundation import checks
from symfric.foundation.parameters import parameters, with_values
from symfric.foundation.variable import symbols_of
from symfric.laws import GMS, Law, LuGre, LuGreNormalised, LuGrePassive, law_name
from symfric.laws.base import smooth
from symfric.laws.base.law import require_law
from symfric.model import Output

USE = "Call it once per sample, and add F to the force that the controller commands."
ERROR = "e is the position error, reference minus measured, in the direction of v."
L = TypeVar("L", bound=Law)
Bristles = LuGre | LuGreNormalised | LuGrePassive
Corrected = tuple[ca.SX, ca.SX]
"""States after the step and mean force over the step."""
ESTIMATE = "estimated friction force, mean over the step, to add to the command"


def lugre_observer(
    law: Bristles,
    gain: float,
    *,
    N: float = 1.0,
    ramp: float | None = 0.1,
    limit: float | None = None,
    h: float | None = None,
    name: str | None = None,
    turning: bool = False,
) -> Block:
    """Return an observer of the bristle deflection of LuGre friction by a position error.

        dz/dt = v - sigma_0 |v| z / g(v) + k e,   |z| <= mu_s N / sigma_0
        F     = sigma_0 z + sigma_1 dz/dt + sigma_2 v

    e is the position error, reference minus measured. The step is exact for held v and e (see
    `law_block`), and z stays in the invariant set of the law, so F is bounded for every gain, error
    and step size.

    Stability: with F added to the force of a linear controller on a mass m, position and friction
    error go to zero if (sigma_1 s + sigma_0) / (m s^2 + k_v s + k_p) is strictly positive real,
    that is if sigma_1 k_v > sigma_0 m, for any k > 0 (Canudas de Wit et al. 1995, in continuous
    time). A sample time, a delay or an integrator in the loop bounds k; k = 0 is the compensator.

    Args:
        law: a law with numbers as parameters.
        gain: gain k [1/s].
        N: normal force [N], a parameter of the C.
        ramp: time [s] of fading in and out at the input `enable`; None omits this input.
        limit: largest force [N].
        h: sample time [s] as a constant; without it h is a parameter, by default 1 ms.
        name: C identifier; default "lugre_observer".
        turning: True for units rad/s and N m.

    Raises:
        ValueError: bad input, or another law.

    Source: Canudas de Wit, Olsson, Astrom, Lischinsky, IEEE TAC 40(3), 1995, section V; the bound
    on z is an addition of symfric.
    """
    where = _check("lugre_observer", law, Bristles, "LuGre()", gain)
    return _observer(
        law, _bristle, gain, N, ramp, limit, h, where, turning, name or "lugre_observer",
        "bristle deflection", "dz/dt of the law + k_e e, |z| <= mu_s N / sigma_0",
    )  # fmt: skip


def _bristle(
    law: Bristles, v: ca.SX, N: ca.SX, z: ca.SX, push: ca.SX, h: ca.SX | float, where: str
) -> Corrected:
    of_force = N if isinstance(law, LuGreNormalised) else 1.0
    most = law.mu_s * (1.0 if isinstance(law, LuGreNormalised) else N) / law.sigma_0
    step = held_step(ca.SX(law.rate(v, N, z)) + push, z, h, ca.SX(1, 1), where)
    end, mean = ca.SX(smooth.clip(step.end, -most, most)), smooth.clip(step.mean, -most, most)
    damping = law.sigma_1
    if isinstance(law, LuGrePassive):
        damping = damping * ca.exp(-((v / law.v_d) ** 2))
    force = law.sigma_0 * mean + damping * (end - z) / h + law.sigma_2 * v
    return end, ca.SX(force * of_force)


def gms_observer(
    law: GMS,
    gain: float,
    *,
    N: float = 1.0,
    ramp: float | None = 0.1,
    limit: float | None = None,
    h: float | None = None,
    name: str | None = None,
    turning: bool = False,
) -> Block:
    """Return an observer of the spring forces of GMS friction by a position error.

        F_i+ = F_i of the law after the step + k_i h k e,   |F_i| <= alpha_i mu_s N
        F    = F_1 + F_2 + ... + sigma_2 v

    e is the position error, reference minus measured; the correction stretches all springs by
    h k e, as it does for the bristle of LuGre. Modes are those of the law. The forces stay in the
    invariant set of the law, so F is bounded for every gain, error and step size. Stability is not
    proved; in tests of closed loops, gains far above 10/s increase the error.

    Args:
        law: a law with form = "event", whose step is known exactly.
        gain: gain k [1/s].
        N, ramp, limit, h, name, turning: as for `lugre_observer`.

    Raises:
        ValueError: bad input, or another law or form.

    Source: Al-Bender, Lampaert, Swevers, IEEE TAC 50(11), 2005, for the law; the correction follows
    the observer of LuGre and is an addition of symfric.
    """
    where = _check("gms_observer", law, GMS, "GMS(form='event')", gain)
    if law.form != "event":
        raise checks.refused(f"{where}: form", "'event', whose step is known", law.form)
    return _observer(
        law, _springs, gain, N, ramp, limit, h, where, turning, name or "gms_observer",
        "spring forces", "F_i+ = F_i of the law + k_i h k_e e, |F_i| <= alpha_i mu_s N",
    )  # fmt: skip


def _springs(
    law: GMS, v: ca.SX, N: ca.SX, z: ca.SX, push: ca.SX, h: ca.SX | float, _where: str
) -> Corrected:
    end, mean = map(ca.SX, law.held_step(v, N, z, h) or ())
    force = law.sigma_2 * v
    for i, (element, share) in enumerate(zip(law.elements, law.shares(), strict=True)):
        more, most = h * push * element.k, share * law.mu_s * N
        end[i] = smooth.clip(end[i] + more, -most, most)
        force = force + smooth.clip(mean[i] + more / 2, -most, most)
    return end, ca.SX(force)


def _check(what: str, law: Law, kinds: type[Law] | UnionType, such_as: str, gain: object) -> str:
    require_law(what, law)
    if not isinstance(law, kinds):
        raise checks.refused(what, f"a law such as {such_as}", law)
    where = f"{what} '{law_name(law)}'"
    checks.number(f"{where}: gain", gain, lower=0.0)
    return where


def _observer(
    law: L,
    corrected: Callable[[L, ca.SX, ca.SX, ca.SX, ca.SX, ca.SX | float, str], Corrected],
    gain: float,
    N: float,
    ramp: float | None,
    limit: float | None,
    h: float | None,
    where: str,
    turning: bool,
    name: str,
    what: str,
    formula: str,
) -> Block:
    """Return the block of an observer of the states of `law`.

    Args:
        corrected: (law, v, N, states, gain times error, step size, where) -> states after the
            step and mean force.
        what: name of the observed states.
        formula: formula of their correction.
    """
    inner = law_block(law, h=h)
    known = parameters(law)
    own = {p.name: p.symbol for p in inner.parameters if p.name in known}
    size = step_size(where, h, inner)
    parts = Parts(inner, inner.inputs[0])
    push = parts.parameter("k_e", gain) * parts.given("e")
    load = checks.number(f"{where}: N", N, unit="N", lower=0.0)
    least = ca.fmax(parts.parameter("N", load), LEAST)
    v, z = inner.inputs[0].symbol, symbols_of(inner.states)
    observed = with_values(law, own)
    results = corrected(observed, v, least, z, push, size.h, where)
    end, force = ca.substitute([*results], [z], [within_load(observed, z, least)])
    parts.next = ca.vertsplit(end)
    force = finished(parts, force, ramp, limit, size.h, where)
    block = arranged(Block(
        name,
        doc=f"Observer of the {what} by the position error. {inner.doc}",
        equations=f"{formula}\n\n{inner.equations}",
        discretisation=without_end(inner.discretisation),
        use=(USE, ERROR, *[LIMITED] * (limit is not None)),
        outputs={"F": Output(force, "N", ESTIMATE)},
        constants=inner.constants,
        about=inner.about,
        limits=inner.limits,
        sources=inner.sources,
        **parts.variables(size.parameters),
    ))  # fmt: skip
    return in_turning(block) if turning else block


def disturbance_observer(
    mass: float,
    bandwidth: float,
    *,
    order: int = 1,
    ramp: float | None = 0.1,
    limit: float | None = None,
    h: float | None = None,
    name: str | None = None,
    turning: bool = False,
) -> Block:
    """Return an observer of all forces that oppose the force of a drive, except inertia.

        d = Q(s) [u - m s v],   Q = (w / (s + w))^order,   F = d

    u is the force that acted up to this sample (with the delay of the drive), minus that of a
    compensator in parallel, so that the observer estimates the remaining friction; v is the
    velocity measured at this sample. Each step computes

        f  = u - m (v - v before) / h          mean opposing force over the last interval
        d+ = d + (1 - exp(-w h)) (f - d)       once for each order

    f is the balance of impulse, exact for a held force; the filter is bounded for every h. The
    observer needs no law, but it lags by order / w, which delays the force after a reversal.

    Stability: with F added to the force, the loop of observer and mass M is stable for every w, h
    and delay of the drive if 0 < m < 2 M, because its open loop Q (1 - m/M) is then below one
    (small gain). Velocity from an encoder causes noise of m count / h^2 (1 - exp(-w h))^order. A
    filter or delay of the velocity alone bounds w: keep w below a fifth of the inverse of the lag.

    Args:
        mass: mass m [kg].
        bandwidth: bandwidth w [rad/s].
        order: order of Q, 1 or 2.
        ramp, limit, h, name, turning: as for `lugre_observer`; default name "disturbance_observer".

    Raises:
        ValueError: bad input.

    Source: Ohnishi, Shibata, Murakami, IEEE/ASME Trans. Mechatronics 1(1), 1996 (Q filter of order
    1); the balance of impulse in place of a filtered derivative is an addition of symfric.
    """
    where = "disturbance_observer"
    mass = checks.number(f"{where}: mass", mass, unit="kg", above=0.0)
    bandwidth = checks.number(f"{where}: bandwidth", bandwidth, unit="rad/s", above=0.0)
    order = checks.count(f"{where}: order", order, least=1, most=2)
    size, parts = step_size(where, h), Parts()
    u, v = map(parts.given, ("u", "v"))
    m, w = map(parts.parameter, ("m", "w"), (mass, bandwidth))
    before = parts.state("v_before")
    parts.next.append(v)
    force = u - m * (v - before) / size.h
    for k in range(order):
        d = parts.state(f"d_{k + 1}")
        force = d + (1 - ca.exp(-w * size.h)) * (force - d)
        parts.next.append(force)
    force = finished(parts, force, ramp, limit, size.h, where)
    block = Block(
        where if name is None else name,
        doc="Disturbance observer: all forces that oppose the force of a drive, except inertia.",
        equations=(
            "f  = u - m (v - v_before) / h\n"
            f"d+ = d + (1 - exp(-w h)) (f - d){', twice' if order == 2 else ''}\nF  = d+"
        ),
        discretisation="The balance of impulse over the last interval, and an exact filter of it.",
        use=(USE, *[LIMITED] * (limit is not None)),
        outputs={"F": Output(force, "N", "estimated opposing force, to add to the command")},
        constants=size.constants,
        **parts.variables(size.parameters),
    )
    return in_turning(block) if turning else block
