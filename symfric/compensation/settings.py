"""Settings of a friction compensator, their checks, and the formula they make."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, final

import numpy as np

from symfric.compensation.force import TERMS
from symfric.foundation import checks

VELOCITIES = ("blend", "reference", "measured")


@final
@dataclass(frozen=True, eq=False)
class Compensation:
    """Settings of a friction compensator; features that are None or empty are not in its C.

    Every number is a parameter of the C that can be changed while it runs.

    Attributes:
        velocity: what moves the law: "blend" is the desired velocity while the measured one is
            below `v_blend` and the measured one beyond twice that; "reference" or "measured" are
            one of them alone. A law that sees measured velocity takes damping from the loop, and
            noise; one that sees the reference compensates what ought to be.
        v_blend: [m/s]; several counts of the encoder a sample, and several v_s of the law.
        N: normal force [N], a parameter of the C; "input" makes it an input. By default that of
            the drive; 1 with a law alone, whose coefficients are then forces.
        scales: terms of friction whose scale, 0 to 1, can be set: names of `TERMS`, or start values
            by name. By default all that the law has, but "bristle", with start value 1.
        without: terms that are left out.
        error_gain: [1/s]; the desired velocity is v_ref + error_gain e, e the position error
            (reference less measured), as the set velocity of a cascade is. Without it there is
            nothing at rest that would break a standing error away. Give it the position gain.
        hold: (error [m], velocity [m/s]): an output `hold` that is 1 where reference and axis are
            slower than the velocity and the error is smaller, else 0. Stop the integrator of the
            controller on it: an axis that breaks away jumps, and one whose jump is longer than a
            count hunts for ever if the integrator never rests.
        dead_zone: velocities up to this [m/s] count as rest.
        build_up: way [m] over which friction builds up after a reversal, of a law without states.
        build_up_table: its shape: (share of the way, share of the force), from (0, 0) to (1, 1).
        offset: constant force [N] that is added; of a drive its own, where it has one.
        inertia: mass [kg] times the reference acceleration is added, too.
        delay: time [s] by which the reference is looked ahead with its acceleration: the lag of the
            drive, and half a step of the law.
        stick: (force [N], time [s], velocity [m/s]): added while the reference moves, faster than
            twice this, and the axis, slower than this, does not; rises and decays over this time.
        dither: (amplitude [N], frequency [Hz]) of a sine.
        ramp: time [s] of fading in and out at the input `enable`; None: no such input.
        limit: largest force [N].
        slew: fastest change of the force [N/s].
    """

    velocity: str = "blend"
    v_blend: float = 0.01
    N: float | str | None = None
    scales: Mapping[str, float] | Sequence[str] | None = None
    without: Sequence[str] = ()
    dead_zone: float | None = None
    build_up: float | None = None
    build_up_table: Sequence[tuple[float, float]] = ()
    offset: float | None = None
    inertia: float | None = None
    delay: float | None = None
    error_gain: float | None = None
    hold: tuple[float, float] | None = None
    stick: tuple[float, float, float] | None = None
    dither: tuple[float, float] | None = None
    ramp: float | None = 0.1
    limit: float | None = None
    slew: float | None = None


def settings_from_text(texts: Sequence[str]) -> Compensation:
    """Settings as a command line has them.

        v_blend=0.02  scales=coulomb:0.9,stribeck:0  without=viscous  stick=1,0.1,1e-3

    Raises:
        ValueError: unknown names, repeated ones, no numbers.
    """
    where, found = "compensation", dict[str, Any]()
    known = [item.name for item in fields(Compensation)]
    for text in texts:
        name, _, value = text.partition("=")
        checks.check_names(where, [name], known)
        if name in found or not value:
            raise checks.refused(where, "NAME=VALUE, every name once", text)
        parts = value.split(",")
        pairs = [part.split(":") for part in parts]
        if name == "velocity" or (name == "N" and value == "input"):
            found[name] = value
        elif name == "without" or (name == "scales" and all(len(pair) == 1 for pair in pairs)):
            found[name] = tuple(parts)
        elif name in ("scales", "build_up_table"):
            if any(len(pair) != 2 for pair in pairs):
                raise checks.refused(f"{where}: {name}", "A:B,A:B,...", value)
            number = [checks.parsed(f"{where}: {name}", pair[1]) for pair in pairs]
            firsts = [pair[0] for pair in pairs]
            found[name] = dict(zip(firsts, number, strict=True))
            if name == "build_up_table":
                shares = [checks.parsed(f"{where}: {name}", first) for first in firsts]
                found[name] = tuple(zip(shares, number, strict=True))
        else:
            numbers = tuple(checks.parsed(f"{where}: {name}", part) for part in parts)
            found[name] = numbers[0] if len(numbers) == 1 else numbers
    return chosen_settings(where, None, found)


def chosen_settings(
    where: str, settings: Compensation | None, chosen: Mapping[str, Any]
) -> Compensation:
    """Combine settings and keywords, and check them."""
    known = [item.name for item in fields(Compensation)]
    checks.check_names(where, chosen, known)
    if settings is None:
        settings = Compensation()
    s = replace(checks.kind(where, settings, Compensation, "settings, Compensation()"), **chosen)
    checks.choice(f"{where}: velocity", s.velocity, VELOCITIES)
    if isinstance(s.N, str):
        checks.choice(f"{where}: N", s.N, ["input"])
    elif s.N is not None:
        checks.number(f"{where}: N", s.N, unit="N", lower=0.0)
    if s.offset is not None:
        checks.number(f"{where}: offset", s.offset, unit="N")
    positive = ("v_blend", "m/s"), ("build_up", "m"), ("ramp", "s")
    for name, unit in positive:
        if getattr(s, name) is not None:
            checks.number(f"{where}: {name}", getattr(s, name), unit=unit, above=0.0)
    others = (
        ("dead_zone", "m/s"),
        ("inertia", "kg"),
        ("delay", "s"),
        ("error_gain", "1/s"),
        ("limit", "N"),
        ("slew", "N/s"),
    )
    for name, unit in others:
        if getattr(s, name) is not None:
            checks.number(f"{where}: {name}", getattr(s, name), unit=unit, lower=0.0)
    if s.velocity == "measured" and (s.error_gain is not None or s.delay is not None):
        raise ValueError(
            f"{where}: error_gain, delay: expected with a desired velocity only, got "
            "velocity = 'measured'"
        )
    _check_numbers(f"{where}: hold", s.hold, "(error [m], velocity [m/s])", 2)
    _check_numbers(f"{where}: stick", s.stick, "(force [N], time [s], velocity [m/s])", 3)
    if s.stick is not None:
        checks.number(f"{where}: stick: velocity", s.stick[2], unit="m/s", above=0.0)
        checks.number(f"{where}: stick: time", s.stick[1], unit="s", above=0.0)
    _check_numbers(f"{where}: dither", s.dither, "(amplitude [N], frequency [Hz])", 2)
    _check_table(f"{where}: build_up_table", s)
    checks.names(f"{where}: without", s.without, TERMS)
    if isinstance(s.scales, Mapping):
        for term, start in checks.named(f"{where}: scales", s.scales, TERMS).items():
            checks.number(f"{where}: scales: {term}", start, lower=0.0)
    elif s.scales is not None:
        checks.names(f"{where}: scales", s.scales, TERMS)
    return s


def _check_numbers(where: str, value: object, what: str, count: int) -> None:
    if value is None:
        return
    found = checks.array(where, value, what=what)
    if found.size != count or (found < 0).any():
        raise checks.refused(where, f"{what}, numbers >= 0", value)


def _check_table(where: str, s: Compensation) -> None:
    if not s.build_up_table:
        return
    if s.build_up is None:
        raise ValueError(f"{where}: expected with build_up only, the way that it is a shape of")
    points = checks.array(where, s.build_up_table, ndim=2, what="pairs of shares")
    ends = points.shape[1] == 2 and (points[0] == 0).all() and (points[-1] == 1).all()
    if not ends or not (np.diff(points[:, 0]) > 0).all() or not (np.diff(points[:, 1]) >= 0).all():
        raise checks.refused(
            where, "rising pairs (share of the way, share of the force) from (0, 0) to (1, 1)",
            s.build_up_table,
        )  # fmt: skip


def formula(s: Compensation) -> str:
    """Formula of the block, line by line."""
    wanted = "v_ref" + " + t_ahead a_ref" * (s.delay is not None)
    wanted += " + k_error e" * (s.error_gain is not None)
    moves = {
        "blend": f"v_c = {wanted} while |v| < v_blend, v beyond 2 v_blend, C2 in between",
        "reference": f"v_c = {wanted}",
        "measured": "v_c = v",
    }[s.velocity]
    lines = [moves]
    if s.dead_zone is not None:
        lines.append("v_c less what lies within +-v_dead")
    force = "F_law(v_c, N)"
    if s.build_up is not None:
        lines.append("built+ = built + 2 v_c h / d_build, held within +-1")
        force = "built F_sliding(|v_c|, N) + viscous"
    force += " + offset" * (s.offset is not None)
    force += " + inertia a_ref" * (s.inertia is not None)
    force += " + F_stick stuck" * (s.stick is not None)
    force += " + F_dither sin(2 pi phase)" * (s.dither is not None)
    lines.append(f"F = {force}, terms of the law by their scales")
    chosen = {
        "faded in by enable over t_ramp": s.ramp,
        "within +-F_max": s.limit,
        "by F_rate h a step at most": s.slew,
    }
    last = [text for text, value in chosen.items() if value is not None]
    return "\n".join([*lines, *([f"F {', '.join(last)}"] if last else [])])
