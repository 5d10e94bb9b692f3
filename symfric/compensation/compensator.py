"""Friction compensator as a block: the force to add to that of a controller, and a controller."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import inf
from typing import Any, final

import casadi as ca

from symfric.codegen import Block, law_block
from symfric.codegen.blocks.from_law import in_turning, step_variable
from symfric.codegen.blocks.variables import arranged
from symfric.compensation.force import (
    TERMS,
    Parts,
    Terms,
    beyond_dead_zone,
    blended,
    built_up,
    dithered,
    freed,
    limited,
    ramped,
    slowed,
    terms,
)
from symfric.compensation.settings import Compensation, chosen_settings, formula
from symfric.foundation import checks
from symfric.foundation.parameters import Parametric, Variable, param
from symfric.laws import Law, law_name
from symfric.laws.base import smooth
from symfric.laws.base.law import check_law
from symfric.model import Output
from symfric.scenes import Drive

INPUTS = ("v_ref", "a_ref", "e", "v", "N", "enable")

USE = (
    "Call it once a sample, with what the controller knows at that sample, and add F to the force "
    "that it commands.",
    "F has the sign of the velocity: it pushes where friction brakes.",
)
OVER = (
    "More than the friction that is there (a scale above 1, or a law that is too high) is negative "
    "damping; where the desired velocity follows the position error the axis then hunts at rest."
)


def compensator(
    law: Law | Drive,
    *,
    name: str | None = None,
    h: float | None = None,
    turning: bool = False,
    fold: bool = False,
    settings: Compensation | None = None,
    **chosen: Any,
) -> Block:
    """Return the block of a friction compensator: the force to add, in the units of the drive.

        v_c = dead zone of the blend of v_ref + delay a_ref + error_gain e and v
        F   = slew(limit(ramp [scaled law(v_c, N) + inertia a_ref + stick + dither]))

    The law makes the step of `law_block`. Scales act on forces, never on its states, so that they
    can be turned while the machine moves.

    Limits: it adds what the law says. More than the friction that is there (a scale above 1, or a
    law that is too high) is negative damping: with `error_gain` the axis then hunts where it should
    rest. Moved by the measured velocity alone a law finds the way out of rest too late, and makes
    hunting worse. Where the reference jumps, bristle damping makes a peak; set a `limit`.

    Measured (`symfric bench codegen`: 1 kg, 1 kHz, counts of 1 um, one sample late; LuGre with half
    the stiffness against four other plants): with `error_gain` and without the term "stribeck" the
    RMS error of a sine is 10 to 15 times smaller, and hunting of 1100 counts after a step is gone.
    That term makes axes jump that break away at once: on exact Coulomb friction 350 counts stay
    with it. Levels of 80 % make the error 5 times smaller, of 50 % twice; 120 % hunt 1000 counts
    there. A law without states and a `build_up` of 0.1 mm does as well as bristles.

    Args:
        law: with numbers, with states or without, a function of v and N; or a drive, which brings
            its law, its load, its offset, and whether it turns.
        name: C identifier; default "friction_compensator".
        h: sample time [s] as a constant; without it a parameter, by default 1 ms.
        turning: units rad/s and N m.
        fold: all parameters but h become constants.
        settings: what it does, or the fields of `Compensation` by name.

    Raises:
        ValueError: bad input; a law with inputs besides v and N, or without a block; build-up of a
            law that has states of its own; unknown terms.
    """
    where = "compensator"
    s = chosen_settings(where, settings, chosen)
    if isinstance(law, Drive):
        s, law, turning = _of_drive(where, law, s), law.law, law.turning or turning
    check_law(where, law)
    where = f"compensator '{law_name(law)}'"
    inner = law_block(law, h=h if law.states else None)
    if len(inner.inputs) > 2:
        names = ", ".join(v.name for v in inner.inputs[2:])
        raise ValueError(f"{where}: expected a law of v and N only, got one with {names}")
    found = terms(law, inner)
    size = next((v for v in inner.parameters if v.name == "h"), step_variable(where, h))
    duration = size.symbol if h is None else float(size.start)
    own = tuple(v for v in inner.parameters if v is not size)
    parts = Parts(states=inner.states, parameters=own)
    wanted, v = _velocity(parts, s)
    moved = v if s.dead_zone is None else beyond_dead_zone(parts, v, s.dead_zone)
    normal = (
        parts.given("N", "N", "normal force", 10.0, lower=0.0)
        if isinstance(s.N, str)
        else parts.parameter("N", 1.0 if s.N is None else s.N, "N", "normal force")
    )
    old, new = ca.vertcat(found.v, found.N), ca.vertcat(moved, normal)
    following = ca.substitute(inner.next, old, new)
    parts.next = ca.vertsplit(following) if inner.states else []
    found = _built(parts, found, s, moved, duration, where)
    force = _scaled(parts, found, s, where)
    force = ca.substitute(force, old, new)
    force = _added(parts, force, s, wanted, duration)
    more = _held(parts, s)
    uses_h = h is None and ca.depends_on(ca.vertcat(force, *parts.next), size.symbol)
    block = Block(
        "friction_compensator" if name is None else name,
        doc=f"Friction compensator: the force to add to that of a controller. {inner.doc}",
        states=tuple(parts.states),
        inputs=tuple(sorted(parts.inputs, key=lambda v: INPUTS.index(v.name))),
        parameters=(*parts.parameters, *[size] * uses_h),
        next=ca.vertcat(ca.SX(0, 1), *parts.next),
        outputs={"F": Output(force, "N", "force to add to that of the controller")} | more,
        about=inner.about,
        constants=dict(inner.constants) | ({} if h is None else {"h": float(size.start)}),
        equations=f"{formula(s)}\n\n{inner.equations}",
        discretisation=without_end(inner.discretisation),
        use=USE,
        limits=(OVER, *inner.limits),
        sources=inner.sources,
    )
    block = arranged(folded(block) if checks.flag(f"{where}: fold", fold) else block)
    return in_turning(block) if turning else block


def _velocity(parts: Parts, s: Compensation) -> tuple[ca.SX, ca.SX]:
    """Return the desired velocity, and the one that moves the law."""
    wanted = v = ca.SX(0)
    if s.velocity != "measured" or s.stick is not None:
        wanted = parts.given("v_ref", "m/s", "reference velocity", 0.1)
    if s.delay is not None and s.velocity != "measured":
        a = parts.given("a_ref", "m/s^2", "reference acceleration")
        delay = parts.parameter("t_ahead", s.delay, "s", "look-ahead of the reference")
        wanted = wanted + delay * a
    if s.error_gain is not None:
        e = parts.given("e", "m", "position error, reference less measured", 1e-5)
        gain = parts.parameter("k_error", s.error_gain, "1/s", "set velocity over error")
        wanted = wanted + gain * e
    if s.velocity != "reference" or s.stick is not None:
        v = parts.given("v", "m/s", "measured velocity", 0.1)
    if s.velocity == "blend":
        return wanted, blended(parts, wanted, v, s.v_blend)
    return wanted, wanted if s.velocity == "reference" else v


def folded(block: Block) -> Block:
    """Return the block with all its parameters but h as constants."""
    gone = [p for p in block.parameters if p.name != "h"]
    symbols = ca.vertcat(*(p.symbol for p in gone))
    numbers = ca.vertcat(*(ca.SX(float(p.start)) for p in gone))

    def constant(expression: Any) -> ca.SX:
        return ca.substitute(ca.SX(expression), symbols, numbers)

    return replace(
        block,
        parameters=tuple(p for p in block.parameters if p.name == "h"),
        next=constant(block.next),
        outputs={
            n: replace(o, expression=constant(o.expression)) for n, o in block.outputs.items()
        },
        constants={p.name: float(p.start) for p in gone} | dict(block.constants),
        about={p.name: f"{p.doc} [{p.unit}]" for p in gone} | dict(block.about),
    )


def without_end(discretisation: str) -> str:
    """Text about the step of the law without the force at its end, which is no output here."""
    return "\n".join(line for line in discretisation.splitlines() if "F_end" not in line)


def _of_drive(where: str, drive: Drive, s: Compensation) -> Compensation:
    """Return the settings with the numbers of a drive where none are given."""
    load = checks.number(f"{where}: N of the drive", drive.N, unit="N", lower=0.0)
    offset = checks.number(f"{where}: offset of the drive", drive.offset, unit="N")
    return replace(
        s,
        N=load if s.N is None else s.N,
        offset=offset or None if s.offset is None else s.offset,
    )


def _built(
    parts: Parts, found: Terms, s: Compensation, v: ca.SX, h: ca.SX | float, where: str
) -> Terms:
    """Return the terms with dry friction that builds up over a way, where that is chosen."""
    if s.build_up is None:
        return found
    if found.law.states:
        raise ValueError(
            f"{where}: build_up: expected a law without states, got one whose states build friction"
            " up over a way of their own"
        )
    return found.one_sided(built_up(parts, v, h, s.build_up, s.build_up_table))


def _scaled(parts: Parts, found: Terms, s: Compensation, where: str) -> ca.SX:
    """Return the force of the law with the scales of its terms."""
    checks.check_names(f"{where}: without", s.without, found.names)
    asked = s.scales
    if asked is None:
        left = [n for n in found.names if n != "bristle" and n not in s.without]
        asked = dict.fromkeys(left, 1.0)
    elif not isinstance(asked, Mapping):
        asked = dict.fromkeys(asked, 1.0)
    checks.check_names(f"{where}: scales", asked, found.names)
    twice = sorted({*asked} & {*s.without})
    if twice:
        raise ValueError(f"{where}: expected terms in scales or in without, got both for {twice}")
    scales: dict[str, ca.SX | float] = dict.fromkeys(s.without, 0.0)
    for term, start in asked.items():
        scales[term] = parts.parameter(f"scale_{term}", start, "1", f"scale: {TERMS[term]}")
    return found.scaled(scales)


def _held(parts: Parts, s: Compensation) -> dict[str, Output]:
    """Return the output that stops the integrator of the controller, where that is chosen."""
    if s.hold is None:
        return {}
    v_ref = parts.given("v_ref", "m/s", "reference velocity", 0.1)
    e = parts.given("e", "m", "position error, reference less measured", 1e-5)
    v = parts.given("v", "m/s", "measured velocity", 0.1)
    band = parts.parameter("e_hold", s.hold[0], "m", "error that is small enough to rest")
    slow = parts.parameter("v_hold", s.hold[1], "m/s", "slower than this is rest")
    small = (ca.fabs(e) <= band, ca.fabs(v_ref) <= slow, ca.fabs(v) <= slow)
    rests = ca.if_else(ca.logic_and(ca.logic_and(*small[:2]), small[2]), 1, 0)
    return {"hold": Output(rests, "1", "1: stop the integrator of the controller")}


def _added(parts: Parts, force: ca.SX, s: Compensation, wanted: ca.SX, h: ca.SX | float) -> ca.SX:
    """Return the force of the law with all that is added, and within its limits."""
    if s.offset is not None:
        more = parts.parameter("offset", s.offset, "N", "constant force", lower=-inf)
        force = force + more
    if s.inertia is not None:
        a = parts.given("a_ref", "m/s^2", "reference acceleration")
        mass = parts.parameter("inertia", s.inertia, "kg", "mass that a_ref is times")
        force = force + mass * a
    if s.stick is not None:
        v = parts.given("v", "m/s", "measured velocity", 0.1)
        more = freed(parts, wanted, v, h, *s.stick)
        force = force + more
    if s.dither is not None:
        more = dithered(parts, h, *s.dither)
        force = force + more
    if s.ramp is not None:
        force = ramped(parts, force, h, s.ramp)
    if s.limit is not None:
        force = limited(parts, force, s.limit)
    if s.slew is not None:
        force = slowed(parts, force, h, s.slew)
    return force


@final
@dataclass(frozen=True, eq=False)
class Cascade(Parametric):
    """Cascade of position (P) and velocity (PI) with an encoder, at a fixed sample time.

        x_m = count round(x / count)                     what the encoder says
        v_m = v_m + share [(x_m - x_m before) / h - v_m]    filtered difference
        v_s = v_ref + kp (r - x_m)                       set velocity
        u   = kv (v_s - v_m) + I + inertia a_ref,   I+ = I + ki kv h (v_s - v_m)

    I and u are held within +-limit; I does not go on where u has reached it, nor on `hold`.
    """

    h: float = param(1e-3, unit="s", role="time", doc="sample time", lower=1e-9)
    kp: float = param(60.0, unit="1/s", doc="position gain", lower=0.0)
    kv: float = param(200.0, unit="N s/m", doc="velocity gain", lower=0.0)
    ki: float = param(20.0, unit="1/s", doc="integral gain of the velocity loop", lower=0.0)
    inertia: float = param(1.0, unit="kg", doc="mass that a_ref is times", lower=0.0)
    limit: float = param(100.0, unit="N", doc="largest force", lower=0.0)
    count: float = param(1e-6, unit="m", doc="one count of the encoder", lower=1e-15)
    share: float = param(
        0.5, unit="1", doc="of a new difference in the velocity", lower=1e-6, upper=1.0
    )

    def block(self) -> Block:
        """Return (x, r, v_ref, a_ref, hold) -> u, and what it measures: x_m, v_m, e, v_s."""
        x, r, v_ref, a_ref, hold = inputs = (
            Variable("x", "m", nominal=0.1, doc="position"),
            Variable("r", "m", nominal=0.1, doc="reference position"),
            Variable("v_ref", "m/s", nominal=0.1, doc="reference velocity"),
            Variable("a_ref", "m/s^2", nominal=1.0, doc="reference acceleration"),
            Variable("hold", "1", lower=0.0, upper=1.0, doc="above 0.5: no integration"),
        )
        before, v_before, integral = states = (
            Variable("before", "m", doc="position before"),
            Variable("v_before", "m/s", doc="velocity before"),
            Variable("integral", "N", doc="integral force"),
        )
        x_m = self.count * ca.floor(x.symbol / self.count + 0.5)
        v_m = v_before.symbol + self.share * ((x_m - before.symbol) / self.h - v_before.symbol)
        e = r.symbol - x_m
        v_s = v_ref.symbol + self.kp * e
        wanted = self.kv * (v_s - v_m) + integral.symbol + self.inertia * a_ref.symbol
        u = smooth.clip(wanted, -self.limit, self.limit)
        more = integral.symbol + self.ki * self.kv * self.h * (v_s - v_m)
        more = smooth.clip(more, -self.limit, self.limit)
        free = ca.logic_or(wanted == u, (v_s - v_m) * u < 0)
        free = ca.logic_and(free, hold.symbol <= 0.5)
        return Block(
            "cascade",
            doc="Position controller: P in position, PI in velocity.",
            states=states,
            inputs=inputs,
            next=ca.vertcat(x_m, v_m, ca.if_else(free, more, integral.symbol)),
            outputs={
                "u": Output(u, "N", "commanded force"),
                "x_m": Output(x_m, "m", "measured position"),
                "v_m": Output(v_m, "m/s", "measured velocity"),
                "e": Output(e, "m", "position error"),
                "v_s": Output(v_s, "m/s", "set velocity"),
            },
        )
