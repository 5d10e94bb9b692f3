"""Settings of a friction compensator, their checks and the resulting formula."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, final

import numpy as np

from symfric.compensation.force import TABLES, TERMS
from symfric.foundation import checks

VELOCITIES = ("blend", "reference", "measured")


@final
@dataclass(frozen=True, eq=False)
class Compensation:
    """Settings of a friction compensator; its C omits features that are None or empty.

    Each number becomes a parameter of the C, which can be changed at run time.

    Attributes:
        velocity: velocity of the law: "reference" is the desired velocity, "measured" the measured
            one; "blend" is the former while the latter is below `v_blend`, and the latter beyond
            twice `v_blend`. A law of the measured velocity reduces the damping of the loop and
            amplifies noise; a law of the reference compensates the planned motion.
        v_blend: velocity of the transition [m/s]; use several counts of the encoder per sample, and
            several v_s of the law.
        N: normal force [N], a parameter of the C, or "input" for an input. By default that of the
            drive; 1 for a law without a drive, whose coefficients are then forces.
        scales: terms of friction with an adjustable scale, 0 to 1: names of `TERMS`, or start
            values by name. By default all terms of the law except "bristle", with start value 1.
        without: names of terms that are omitted.
        error_gain: gain [1/s] of the position error e (reference minus measured); the desired
            velocity is v_ref + error_gain e, as the set velocity of a cascade. Without it, a
            constant error at rest remains. Use the position gain of the controller.
        hold: (error [m], velocity [m/s]) for an output `hold` that is 1 if reference and axis are
            slower than the velocity and the error is smaller than the error, else 0. It must stop
            the integrator of the controller: otherwise an axis that jumps by more than a count at
            break-away hunts permanently.
        dead_zone: velocity [m/s] up to which the law is at rest.
        build_up: travel [m] over which friction builds up after a reversal; for laws without
            states.
        build_up_table: shape of the build-up: pairs (share of the travel, share of the force) from
            (0, 0) to (1, 1).
        offset: additional constant force [N]; by default that of the drive.
        inertia: mass [kg] whose product with the reference acceleration is added.
        delay: look-ahead time [s] of the reference, by its acceleration; use the lag of the drive
            plus half a step of the law.
        stick: (force [N], time [s], velocity [m/s]) of a force that is added while the reference is
            faster than twice the velocity and the axis slower than it; it rises and decays over the
            time.
        dither: (amplitude [N], frequency [Hz]) of an additional sine.
        ramp: time [s] of fading in and out at the input `enable`; None omits this input.
        limit: largest force [N].
        slew: fastest change of the force [N/s].
        counts: with a drive, the block has the input `counts` of its encoder instead of the
            measured velocity; this is the time constant [s] of the filter of their difference, 0
            for none.
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
    counts: float | None = None


def pairs_of(where: str, texts: Sequence[str], known: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Yield name and value of each setting NAME=VALUE,NAME=VALUE; names are `known`, and once."""
    found = set[str]()
    for text in (setting for some in texts for setting in re.split(r",(?=\w+=)", some)):
        name, _, value = text.partition("=")
        checks.check_names(where, [name], known)
        if name in found or not value:
            raise checks.refused(where, "NAME=VALUE, every name once", text)
        found.add(name)
        yield name, value


def settings_from_text(texts: Sequence[str]) -> Compensation:
    """Return the settings given by arguments of a command line, each with one or several settings.

        v_blend=0.02,N=100  scales=coulomb:0.9,stribeck:0  without=viscous  stick=1,0.1,1e-3

    Raises:
        ValueError: unknown or repeated names, or values that are not numbers.
    """
    where, found = "compensation", dict[str, Any]()
    for name, value in pairs_of(where, texts, [item.name for item in fields(Compensation)]):
        at, parts = f"{where}: {name}", tuple(value.split(","))
        if name == "velocity" or (name == "N" and value == "input"):
            found[name] = value
        elif name == "without" or (name == "scales" and ":" not in value):
            found[name] = parts
        elif name in ("scales", "build_up_table"):
            pairs = [part.partition(":") for part in parts]
            if not all(second for *_, second in pairs):
                raise checks.refused(at, "A:B,A:B,...", value)
            numbers = [checks.parsed(at, second) for *_, second in pairs]
            if name == "scales":
                found[name] = dict(zip((first for first, *_ in pairs), numbers, strict=True))
            else:
                firsts = (checks.parsed(at, first) for first, *_ in pairs)
                found[name] = tuple(zip(firsts, numbers, strict=True))
        else:
            numbers = tuple(checks.parsed(at, part) for part in parts)
            found[name] = numbers[0] if len(numbers) == 1 else numbers
    return chosen_settings(where, None, found)


def chosen_settings(
    where: str, settings: Compensation | None, chosen: Mapping[str, Any]
) -> Compensation:
    """Return settings combined with keywords, after checking them."""
    checks.check_names(where, chosen, [item.name for item in fields(Compensation)])
    settings = Compensation() if settings is None else settings
    s = replace(checks.kind(where, settings, Compensation, "settings, Compensation()"), **chosen)
    checks.choice(f"{where}: velocity", s.velocity, VELOCITIES)
    if isinstance(s.N, str):
        checks.choice(f"{where}: N", s.N, ["input"])
    for name, bound in TABLES["settings"].items():
        value = getattr(s, name)
        if value is not None and (name, value) != ("N", "input"):
            checks.number(f"{where}: {name}", value, **bound)
    if s.velocity == "measured" and (s.error_gain is not None or s.delay is not None):
        raise ValueError(
            f"{where}: error_gain, delay: expected with a desired velocity only, got "
            "velocity = 'measured'"
        )
    for name, what, count in (
        ("hold", "(error [m], velocity [m/s])", 2),
        ("stick", "(force [N], time [s], velocity [m/s])", 3),
        ("dither", "(amplitude [N], frequency [Hz])", 2),
    ):
        value = getattr(s, name)
        if value is not None:
            found = checks.array(f"{where}: {name}", value, what=what)
            if found.size != count or (found < 0).any():
                raise checks.refused(f"{where}: {name}", f"{what}, numbers >= 0", value)
    if s.stick is not None:
        checks.number(f"{where}: stick: velocity", s.stick[2], unit="m/s", above=0.0)
        checks.number(f"{where}: stick: time", s.stick[1], unit="s", above=0.0)
    _check_table(f"{where}: build_up_table", s)
    checks.names(f"{where}: without", s.without, TERMS)
    if isinstance(s.scales, Mapping):
        for term, start in checks.named(f"{where}: scales", s.scales, TERMS).items():
            checks.number(f"{where}: scales: {term}", start, lower=0.0)
    elif s.scales is not None:
        checks.names(f"{where}: scales", s.scales, TERMS)
    return s


def _check_table(where: str, s: Compensation) -> None:
    if not s.build_up_table:
        return
    if s.build_up is None:
        raise ValueError(f"{where}: expected with build_up only, whose shape it is")
    points = checks.array(where, s.build_up_table, ndim=2, what="pairs of shares")
    ends = points.shape[1] == 2 and (points[0] == 0).all() and (points[-1] == 1).all()
    if not ends or not (np.diff(points[:, 0]) > 0).all() or not (np.diff(points[:, 1]) >= 0).all():
        raise checks.refused(
            where, "rising pairs (share of the way, share of the force) from (0, 0) to (1, 1)",
            s.build_up_table,
        )  # fmt: skip


def formula(s: Compensation, amperes: bool = False) -> str:
    """Return the formula of the block, line by line; `amperes` for a current as output."""
    desired = "v_ref" + " + t_ahead a_ref" * (s.delay is not None)
    desired += " + k_error e" * (s.error_gain is not None)
    velocity = {
        "blend": f"v_c = {desired} while |v| < v_blend, v beyond 2 v_blend, C2 in between",
        "reference": f"v_c = {desired}",
        "measured": "v_c = v",
    }
    lines = [velocity[s.velocity]]
    if s.dead_zone is not None:
        lines.append("v_c minus its part within +-v_dead")
    force = "F_law(v_c, N)"
    if s.build_up is not None:
        lines.append("built+ = built + 2 v_c h / d_build, held within +-1")
        force = "built F_sliding(|v_c|, N) + viscous"
    force += " + offset" * (s.offset is not None)
    force += " + inertia a_ref" * (s.inertia is not None)
    force += " + F_stick stuck" * (s.stick is not None)
    force += " + F_dither sin(2 pi phase)" * (s.dither is not None)
    lines.append(f"F = {force}, terms of the law by their scales")
    unit, out = ("i", "current = k_i F_m(F, v_c), F") if amperes else ("F", "F")
    stages = (
        ("faded in by enable over t_ramp", s.ramp),
        (f"{'current ' * amperes}changed by at most {unit}_rate h per step", s.slew),
        (f"{'current ' * amperes}within +-{unit}_max", True if amperes else s.limit),
    )
    last = ", ".join(text for text, value in stages if value is not None)
    return "\n".join([*lines, *[f"{out} {last}"] * bool(last)])
