"""Settings of compensators, of estimators of changing friction, their checks and formulas."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, final

import numpy as np

from symfric.compensation.force import PARAMETERS, TABLES, TERMS
from symfric.foundation import checks
from symfric.foundation.parameters import Variable

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


WORDS, NAMES = ("velocity",), ("without", "free")
ROWS = {"scales": (1, 1), "build_up_table": (0, 2), "spread": (1, 1), "bounds": (1, 2)}
"""Settings in texts that are a word, names, and rows A:B: numbers of names and numbers in a row."""


def _values(where: str, kind: type, texts: Sequence[str], rows: str) -> dict[str, Any]:
    """Return the values of settings NAME=VALUE,NAME=VALUE of the dataclass `kind`, every name once.

    Args:
        rows: description of `ROWS` for messages.
    """
    found, known = dict[str, Any](), [item.name for item in fields(kind)]
    for text in (setting for some in texts for setting in re.split(r",(?=\w+=)", some)):
        name, _, value = text.partition("=")
        checks.check_names(where, [name], known)
        if name in found or not value:
            raise checks.refused(where, "NAME=VALUE, every name once", text)
        at, parts = f"{where}: {name}", tuple(value.split(","))
        if name in WORDS or (name, value) == ("N", "input"):
            found[name] = value
        elif name in NAMES or (name == "scales" and ":" not in value):
            found[name] = parts
        elif name in ROWS:
            named, count = ROWS[name]
            table = [part.split(":") for part in parts]
            if any(len(row) != named + count for row in table):
                raise checks.refused(at, rows, value)
            numbers = [tuple(checks.parsed(at, x) for x in row[named:]) for row in table]
            single = [row if count > 1 else row[0] for row in numbers]
            firsts = (row[0] for row in table)
            found[name] = dict(zip(firsts, single, strict=True)) if named else tuple(single)
        else:
            numbers = tuple(checks.parsed(at, part) for part in parts)
            found[name] = numbers[0] if len(numbers) == 1 else numbers
    return found


def settings_from_text(texts: Sequence[str]) -> Compensation:
    """Return the settings given by arguments of a command line, each with one or several settings.

        v_blend=0.02,N=100  scales=coulomb:0.9,stribeck:0  without=viscous  stick=1,0.1,1e-3

    Raises:
        ValueError: unknown or repeated names, or values that are not numbers.
    """
    where = "compensation"
    return chosen_settings(where, None, _values(where, Compensation, texts, "A:B,A:B,..."))


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


SHARES = {"accuracy": 0.05, "memory": 0.05}
"""Default accuracy over the level of the law, and default memory over the time of change."""
SLIDING, FALLEN, SAMPLES, AROUND = 5.0, 2.0, 10, 5.0
"""Slowest sliding over the noise of the velocity, and over the velocity scale of the law; window in
samples; bounds over the spread."""


@final
@dataclass(frozen=True, eq=False)
class Adaptation:
    """Settings of an estimator; numbers become parameters of the C.

    Attributes:
        mass: moving mass [kg]; default that of the drive.
        noise: standard deviation of the measured velocity [m/s]; required. For differences of an
            encoder with steps of `count` [m] it is count / (h sqrt(6)).
        accuracy: standard deviation of the force of the law with the right parameters [N]; default
            5 % of its level at rest.
        window: time [s] over which the errors of the law are correlated; default the larger of ten
            samples and 2 mass noise / accuracy, the time in which noise of the velocity causes an
            error of the force of that size.
        change: time [s] in which a parameter may change by its spread.
        memory: time constant [s] of forgetting of the recursive least squares; default a twentieth
            of `change`, which causes a lag of 5 % of the spread. It must exceed the time in which
            the motion shows all parameters.
        slowest: speed [m/s] below which samples are not used; default the larger of 5 `noise` and
            twice the velocity scale of the law, such as v_s, where the excess of break-away has
            fallen to 2 %. Stiffness and curve at lower speeds are seldom known well.
        valid: force [N] from which samples are not used, such as the limit of the drive.
        free: estimated parameters of the compensator: scales, offset, inertia, or parameters of
            the law. Default: the scales of dry and viscous friction, and the offset. Without
            "scale_stribeck", all dry levels change by "scale_coulomb". Write its estimate also to
            scale_stribeck of the compensator, unless scale_stribeck is 0 against hunting.
        spread: parameter -> standard deviation of its changes; default 1 for scales, the level of
            the law for the offset, and half the start value for other parameters.
        bounds: parameter -> (lowest, highest) output; default five spreads around the start value,
            within the bounds of the parameter.
    """

    mass: float | None = None
    noise: float | None = None
    accuracy: float | None = None
    window: float | None = None
    change: float = 60.0
    memory: float | None = None
    slowest: float | None = None
    valid: float | None = None
    free: Sequence[str] | None = None
    spread: Mapping[str, float] | None = None
    bounds: Mapping[str, tuple[float, float]] | None = None


def chosen_adaptation(
    where: str, settings: Adaptation | None, chosen: Mapping[str, Any]
) -> Adaptation:
    """Return settings combined with keywords, after checking their numbers."""
    checks.check_names(where, chosen, [item.name for item in fields(Adaptation)])
    settings = Adaptation() if settings is None else settings
    s = replace(checks.kind(where, settings, Adaptation, "settings, Adaptation()"), **chosen)
    for name, bound in TABLES["adaptation"].items():
        if getattr(s, name) is not None:
            checks.number(f"{where}: {name}", getattr(s, name), **bound)
    if s.noise is None:
        hint = "of an encoder: count / (h sqrt(6))"
        raise checks.refused(f"{where}: noise", "the deviation of the velocity", None, hint)
    return s


def adaptation_from_text(texts: Sequence[str]) -> Adaptation:
    """Return the settings given by arguments of a command line, each with one or several settings.

        noise=1e-4,mass=2  free=scale_coulomb,offset  spread=offset:2  bounds=offset:-5:5

    Raises:
        ValueError: unknown or repeated names, or values that are not numbers.
    """
    where, rows = "adaptation", "A:1,B:2 or, for bounds, A:LOW:HIGH"
    return chosen_adaptation(where, None, _values(where, Adaptation, texts, rows))


def estimated(
    where: str, s: Adaptation, known: Mapping[str, Variable], level: float, idle: Sequence[str]
) -> tuple[Variable, ...]:
    """Return the estimated parameters; `nominal` is the spread, `lower` and `upper` the bounds.

    Args:
        known: parameters that may be estimated, with the values of the law as start values.
        level: force of the law at rest [N].
        idle: parameters that have no effect on the force.
    """
    usual = ("scale_coulomb", "scale_force", "scale_viscous", "offset")
    free = [n for n in usual if n in known and n not in idle] if s.free is None else s.free
    names = checks.names(f"{where}: free", free, known)
    without = [n for n in names if n in idle]
    if without or not names:
        got = f"{', '.join(without)} without an effect" if without else "none"
        raise ValueError(f"{where}: free: expected parameters that have an effect, got {got}")
    spreads = checks.named(f"{where}: spread", s.spread, names)
    bounds = checks.named(f"{where}: bounds", s.bounds, names)
    return tuple(
        _estimate(where, known[name], spreads.get(name), bounds.get(name), level) for name in names
    )


def _estimate(where: str, p: Variable, spread: object, bounds: object, level: float) -> Variable:
    start = float(p.start)
    if spread is None:
        usual = level if p.name == "offset" else abs(start) / 2
        spread = 1.0 if p.name.startswith("scale_") else usual
    at = f"{where}: spread of '{p.name}'"
    wide = checks.number(at, spread, unit=p.unit, above=0.0)
    around = max(p.lower, start - AROUND * wide), min(p.upper, start + AROUND * wide)
    bounds = around if bounds is None else bounds
    what = f"(low, high) around {start:g}"
    found = checks.array(f"{where}: bounds of '{p.name}'", bounds, what=what).tolist()
    if len(found) != 2 or not found[0] <= start <= found[1]:
        raise checks.refused(f"{where}: bounds of '{p.name}'", what, bounds)
    low, high = found
    return Variable(p.name, p.unit, start=start, nominal=wide, lower=low, upper=high, doc=p.doc)


def scale_parameters(terms: Sequence[str], offset: float, mass: float) -> dict[str, Variable]:
    """Return the parameters of a compensator that are not those of its law."""
    starts = {f"scale_{n}": 1.0 for n in terms} | {"offset": offset, "inertia": mass}
    return {n: Variable(n, start=x, **({"lower": 0.0} | PARAMETERS[n])) for n, x in starts.items()}
