"""Friction compensator as a block: the force to add to the force of a controller."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import casadi as ca

from symfric.codegen import Block, law_block
from symfric.codegen.blocks.from_law import in_turning
from symfric.codegen.blocks.variables import arranged, step_size
from symfric.compensation.force import LIMITED, TABLES, Parts, Terms, finished, terms, within_load
from symfric.compensation.settings import Compensation, chosen_settings, formula
from symfric.drives.drive import Drive as Nameplate
from symfric.foundation import checks
from symfric.foundation.variable import starts_of, symbols_of
from symfric.laws import Law, law_name
from symfric.laws.base import smooth
from symfric.laws.base.law import require_law
from symfric.model import Output
from symfric.scenes import Drive

USE = (
    "Call it once per sample, with the signals of that sample, and add F to the force that the "
    "controller commands.",
    "F has the sign of the velocity and counteracts friction.",
)
OVER = (
    "A force above the actual friction (a scale above 1, or too high a law) is negative damping; "
    "if the desired velocity follows the position error, the axis then hunts at rest."
)


def compensator(
    law: Law | Drive,
    *,
    name: str | None = None,
    h: float | None = None,
    turning: bool = False,
    fold: bool = False,
    drive: Nameplate | None = None,
    settings: Compensation | None = None,
    **chosen: Any,
) -> Block:
    """Return the block of a friction compensator: the force to add, in the units of the drive.

        v_c = dead zone of the blend of v_ref + delay a_ref + error_gain e and v
        F   = limit(slew(ramp [scaled law(v_c, N) + inertia a_ref + stick + dither]))

    The law makes the step of `law_block`. Scales act on forces and not on the states of the law, so
    that they can be changed while the machine moves.

    With a `drive`, the output is a current [A], the last stages act on it, and so does its limit:

        i = limit(slew(F_m(ramp [...], v_c) k_i)),   k_i = 1 / (ratio torque_constant)

    with the force F_m of the motor for a force at the load (`Drive.from_load`). The power flow is
    that of the force of the block alone, which drives while F v_c > 0.

    Limits: a force above the actual friction (a scale above 1, or too high a law) is negative
    damping: with `error_gain` the axis then hunts at rest. A law of the measured velocity alone
    reacts too late at break-away and increases hunting. Bristle damping has a peak where the
    reference jumps; set a `limit`.

    Measured results (`symfric bench codegen`: 1 kg, 1 kHz, counts of 1 um, a delay of one sample;
    LuGre with half the stiffness against four other plants): with `error_gain` and without the term
    "stribeck", the RMS error of a sine is 10 to 15 times smaller, and hunting of 1100 counts after
    a step vanishes. With that term, axes that break away at once jump: 350 counts remain on exact
    Coulomb friction. Levels of 80 % divide the error by 5, levels of 50 % by 2; levels of 120 %
    cause hunting of 1000 counts on exact Coulomb friction. A law without states and a `build_up` of
    0.1 mm are as accurate as bristles.

    Args:
        law: a law of v and N with numbers as parameters; or a drive, which defines law, load,
            offset and units.
        name: C identifier; default "friction_compensator".
        h: sample time [s] as a constant; without it h is a parameter, by default 1 ms.
        turning: True for units rad/s and N m.
        fold: True if all parameters except h become constants.
        drive: drive of the axis; the current is limited to its `current_limit` and to `limit`
            [N] at an efficiency of 1.
        settings: features; keywords name fields of `Compensation` and replace those in `settings`.

    Raises:
        ValueError: bad input; a law with inputs other than v and N, or without a block; build-up of
            a law with states; unknown terms.
    """
    where = "compensator"
    s = chosen_settings(where, settings, chosen)
    law, s, turning = _axis(law, s, turning, drive, where)
    require_law(where, law)
    where = f"compensator '{law_name(law)}'"
    inner = law_block(law, h=h if law.states else None)
    if len(inner.inputs) > 2:
        names = ", ".join(v.name for v in inner.inputs[2:])
        raise ValueError(f"{where}: expected a law of v and N only, got one with {names}")
    found, size, parts = terms(law, inner), step_size(where, h, inner), Parts(inner)
    counting = list[ca.SX]()
    if s.counts is not None:
        counting = counted(parts, drive, size.h, s.counts, where)
        parts.derived["v"] = counting[-1]
    wanted, moved = _velocity(parts, s)
    if isinstance(s.N, str):
        normal = parts.given("N")
    else:
        normal = parts.parameter("N", 1.0 if s.N is None else s.N)
    z = symbols_of(inner.states)
    old = ca.vertcat(found.v, found.N, z)
    new = ca.vertcat(moved, normal, within_load(found.law, z, normal) if inner.states else z)
    parts.next = ca.vertsplit(ca.substitute(inner.next, old, new)) if inner.states else []
    parts.next += counting
    if s.build_up is not None:
        if law.states:
            raise ValueError(
                f"{where}: build_up: expected a law without states, got one whose states build "
                "friction up over a way of their own"
            )
        built = built_up(parts, moved, size.h, s.build_up, s.build_up_table)
        found = found.one_sided(built)
    force = ca.substitute(_scaled(parts, found, s, where), old, new)
    force = _added(parts, force, s, wanted, size.h, where, drive, moved)
    more = _held(parts, s)
    parts.inputs.sort(key=lambda v: [*TABLES["inputs"]].index(v.name))
    out, unit, added = ("F", "N", "force") if drive is None else ("current", "A", "current")
    used = [p for p in size.parameters if ca.depends_on(ca.vertcat(force, *parts.next), p.symbol)]
    block = Block(
        "friction_compensator" if name is None else name,
        doc=f"Friction compensator: the {added} to add to that of a controller. {inner.doc}",
        outputs={out: Output(force, unit, f"{added} to add to that of the controller")} | more,
        about=inner.about,
        constants=dict(inner.constants) | size.constants,
        equations=f"{formula(s, drive is not None)}\n\n{inner.equations}",
        discretisation=without_end(inner.discretisation),
        use=tuple(_use(s.limit is not None, drive)),
        limits=(OVER, *inner.limits),
        sources=inner.sources,
        **parts.variables(tuple(used)),
    )
    block = arranged(folded(block) if checks.flag(f"{where}: fold", fold) else block)
    return in_turning(block) if turning else block


def _axis(
    law: Law | Drive, s: Compensation, turning: bool, drive: Nameplate | None, where: str
) -> tuple[Law, Compensation, bool]:
    """Return the law, the settings and the kind of units of an axis, after checking its drive."""
    if isinstance(law, Drive):
        load = checks.number(f"{where}: N of the drive", law.N, unit="N", lower=0.0)
        offset = checks.number(f"{where}: offset of the drive", law.offset, unit="N")
        s = replace(
            s,
            N=load if s.N is None else s.N,
            offset=offset or None if s.offset is None else s.offset,
        )
        law, turning = law.law, law.turning or turning
    if drive is not None:
        checks.kind(f"{where}: drive", drive, Nameplate, "a drive, such as Drive.read(path)")
        if turning and not drive.turning:
            raise checks.refused(f"{where}: drive", "a rotary drive for a rotary axis", drive)
        turning = drive.turning
    return law, s, turning


def _velocity(parts: Parts, s: Compensation) -> tuple[ca.SX, ca.SX]:
    """Return the desired velocity and the velocity of the law."""
    wanted = v = ca.SX(0)
    if s.velocity != "measured" or s.stick is not None:
        wanted = parts.given("v_ref")
    if s.delay is not None and s.velocity != "measured":
        a = parts.given("a_ref")
        wanted = wanted + parts.parameter("t_ahead", s.delay) * a
    if s.error_gain is not None:
        e = parts.given("e")
        wanted = wanted + parts.parameter("k_error", s.error_gain) * e
    if s.velocity != "reference" or s.stick is not None:
        v = parts.given("v")
    moved = wanted if s.velocity == "reference" else v
    if s.velocity == "blend":
        share = smooth.step5(ca.fabs(v) / parts.parameter("v_blend", s.v_blend) - 1)
        moved = share * v + (1 - share) * wanted  # exactly one of them at each end
    if s.dead_zone is not None:
        width = parts.parameter("v_dead", s.dead_zone)
        moved = moved - smooth.clip(moved, -width, width)
    return wanted, ca.SX(moved)


def folded(block: Block) -> Block:
    """Return the block with all parameters except h as constants."""
    gone = [p for p in block.parameters if p.name != "h"]
    symbols, starts = symbols_of(gone), starts_of(gone)

    def constant(expression: Any) -> ca.SX:
        return ca.substitute(ca.SX(expression), symbols, starts)

    outputs = {n: replace(o, expression=constant(o.expression)) for n, o in block.outputs.items()}
    return replace(
        block,
        parameters=tuple(p for p in block.parameters if p.name == "h"),
        next=constant(block.next),
        outputs=outputs,
        constants={p.name: float(p.start) for p in gone} | dict(block.constants),
        about={p.name: f"{p.doc} [{p.unit}]" for p in gone} | dict(block.about),
    )


def without_end(discretisation: str) -> str:
    """Return the text about the step of a law without the lines about `F_end`."""
    return "\n".join(line for line in discretisation.splitlines() if "F_end" not in line)


def built_up(
    parts: Parts, v: ca.SX, h: ca.SX | float, distance: float, table: Sequence[tuple[float, float]]
) -> ca.SX:
    """Return the mean over the step of the share b of sliding friction that has built up.

    b+ = b + 2 v h / distance, within [-1, 1]: linear in the travel since the reversal, or shaped
    by the table. A shorter travel back leaves the remaining share, as in a Maxwell element.
    """
    way, x = parts.parameter("d_build", distance), smooth.clip(parts.state("built"), -1.0, 1.0)
    end = ca.SX(smooth.clip(x + 2 * v * h / way, -1.0, 1.0))
    mean = (x + end) / 2
    if table:
        s, shape = (1 + mean) / 2, ca.SX(table[0][1])
        for (a, low), (b, high) in pairwise(table):
            shape += (high - low) * smooth.clip((s - a) / (b - a), 0.0, 1.0)
        mean = 2 * shape - 1
    parts.next.append(end)
    return mean


def _scaled(parts: Parts, found: Terms, s: Compensation, where: str) -> ca.SX:
    """Return the force of the law with scaled terms."""
    checks.check_names(f"{where}: without", s.without, found.names)
    scaled = s.scales
    if scaled is None:
        scaled = [n for n in found.names if n != "bristle" and n not in s.without]
    if not isinstance(scaled, Mapping):
        scaled = dict.fromkeys(scaled, 1.0)
    checks.check_names(f"{where}: scales", scaled, found.names)
    twice = sorted({*scaled} & {*s.without})
    if twice:
        raise ValueError(f"{where}: expected terms in scales or in without, got both for {twice}")
    scales: dict[str, ca.SX | float] = dict.fromkeys(s.without, 0.0)
    for term, start in scaled.items():
        scales[term] = parts.parameter(f"scale_{term}", start)
    return found.scaled(scales)


def _held(parts: Parts, s: Compensation) -> dict[str, Output]:
    """Return the output that stops the integrator of the controller; {} if it is not chosen."""
    if s.hold is None:
        return {}
    v_ref, e, v = map(parts.given, ("v_ref", "e", "v"))
    band, slow = map(parts.parameter, ("e_hold", "v_hold"), s.hold)
    small = (ca.fabs(e) <= band, ca.fabs(v_ref) <= slow, ca.fabs(v) <= slow)
    rests = ca.if_else(ca.logic_and(ca.logic_and(*small[:2]), small[2]), 1, 0)
    return {"hold": Output(rests, "1", "1: stop the integrator of the controller")}


def freed(
    parts: Parts, wanted: ca.SX, v: ca.SX, h: ca.SX | float, numbers: tuple[float, float, float]
) -> ca.SX:
    """Return an additional force that grows while the desired velocity moves and the axis does not.

    Its share q in [-1, 1] moves at the rate 1/t_stick towards sign(v_ref) while |v| is below
    v_stick and |v_ref| above 2 v_stick, and towards 0 if |v| is above 2 v_stick or |v_ref| below
    v_stick; the goal is linear in between.

    Args:
        numbers: start values of F_stick [N], t_stick [s] and v_stick [m/s].
    """
    most, pace, slow = map(parts.parameter, ("F_stick", "t_stick", "v_stick"), numbers)
    q = smooth.clip(parts.state("stuck"), -1.0, 1.0)
    rests = smooth.clip(2 - ca.fabs(v) / slow, 0.0, 1.0)
    moves = smooth.clip(ca.fabs(wanted) / slow - 1, 0.0, 1.0)
    goal = ca.sign(wanted) * moves * rests
    end = q + smooth.clip(goal - q, -h / pace, h / pace)
    parts.next.append(ca.SX(end))
    return ca.SX(most * end)


def _added(
    parts: Parts, force: ca.SX, s: Compensation, wanted: ca.SX, h: ca.SX | float, where: str,
    drive: Nameplate | None, moved: ca.SX,
) -> ca.SX:  # fmt: skip
    """Return the force of the law plus all additional forces, or its current, within limits."""
    if s.offset is not None:
        force = force + parts.parameter("offset", s.offset)
    if s.inertia is not None:
        a = parts.given("a_ref")
        force = force + parts.parameter("inertia", s.inertia) * a
    if s.stick is not None:
        force = force + freed(parts, wanted, parts.given("v"), h, s.stick)
    if s.dither is not None:
        amplitude, pace = map(parts.parameter, ("F_dither", "f_dither"), s.dither)
        end = ca.SX(smooth.fraction(parts.state("phase") + pace * h))
        parts.next.append(end)
        force = force + amplitude * ca.sin(2 * ca.pi * end)
    if drive is None:
        return finished(parts, force, s.ramp, s.limit, h, where, s.slew)
    k, exact = 1 / float(drive.force_constant), replace(drive, force_width=0.0)

    def amperes(force: ca.SX) -> ca.SX:
        return ca.SX(parts.parameter("k_i", k) * exact.from_load(force, moved))

    given = None if s.limit is None else abs(k) * s.limit
    limit = min((i for i in (given, drive.current_limit) if i is not None), default=None)
    slew = None if s.slew is None else abs(k) * s.slew
    return finished(parts, force, s.ramp, limit, h, where, slew, amperes)


def _use(limited: bool, drive: Nameplate | None) -> Iterator[str]:
    """Yield advice for the header."""
    if drive is None:
        yield from (*USE, *[LIMITED] * limited)
        return
    yield USE[0].replace("add F to the force", "add `current` to the current")
    yield "A positive current drives the load towards " + (
        "positive x." if float(drive.force_constant) > 0 else "negative x: the drive is reversed."
    )
    if limited or drive.current_limit is not None:
        yield LIMITED.replace("F_max", "i_max").replace("F is", "The current is")


def counted(
    parts: Parts, drive: Nameplate | None, h: ca.SX | float, lag: float, where: str
) -> list[ca.SX]:
    """Return the states after the step for the velocity of the load from the counts of an encoder.

        v+ = v + h / (h + t_counts) (count d / h - v),   d = counts - counts of the last call

    d is taken modulo the counter of the drive, the nearest to 0. The first call gives v = 0. The
    states are the counts, 1 after the first call, and the velocity.

    Raises:
        ValueError: no drive, or one without an encoder.
    """
    if drive is None or drive.count is None:
        such = "a drive with counts_per_turn or resolution"
        raise checks.refused(f"{where}: counts", such, drive)
    counts = ca.floor(parts.given("counts") + 0.5)  # whole numbers are also exact in float
    last, begun = parts.state("counted"), parts.state("begun")
    before, t = parts.state("v_before"), parts.parameter("t_counts", lag)
    d = counts - last
    if drive.counter is not None:
        d = d - drive.counter * ca.floor(d / drive.counter + 0.5)
    v = before + h / (h + t) * (drive.count * begun * d / h - before)
    return [counts, ca.SX(1.0), ca.SX(v)]
