"""Properties of a law without running it: phenomena, smoothness, parameters, cost in C."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from math import isfinite, nan

import numpy as np

from symfric.choice.friction import Friction
from symfric.codegen.blocks.from_law import law_block
from symfric.codegen.layout import CBlock
from symfric.codegen.source import routines
from symfric.embedded import measure
from symfric.emitter.c99 import REALS
from symfric.foundation import checks
from symfric.foundation.parameters import Parameter, options, parameters
from symfric.foundation.programs import CompileError
from symfric.laws import Law, steady_force

NEEDS = {
    "sliding": ("D", "kinetic friction"),
    "stiction": ("S", "static friction or a peak at break-away"),
    "stribeck": ("St", "friction falls as sliding begins"),
    "viscous": ("V", "friction grows with the velocity"),
    "presliding": ("P", "elastic displacement before break-away"),
    "memory": ("M", "hysteresis loops close inside each other"),
    "lag": ("L", "friction follows the velocity late"),
    "loading-rate": ("B", "break-away depends on how fast the load grows"),
    "drift-free": ("N", "no creep under vibration below break-away"),
    "dwell": ("T", "static friction grows with the time at rest"),
}
"""Word -> code of `symfric.laws.PHENOMENA`, and what it means."""

ALIASES = {
    "static": "stiction",
    "static-friction": "stiction",
    "break-away": "stiction",
    "dynamic": "sliding",
    "kinetic": "sliding",
    "pre-sliding": "presliding",
    "hysteresis": "memory",
    "frictional-lag": "lag",
    "no-drift": "drift-free",
    "ageing": "dwell",
}
"""Other words for the same, as papers use them."""


def needed(where: str, given: object) -> tuple[str, ...]:
    """Return the words of `NEEDS` that `given` means: words, aliases or codes, in this order.

    Raises:
        ValueError: a text instead of a sequence, or a word that means nothing; it lists all.
    """
    of_code = {code: word for word, (code, _) in NEEDS.items()}
    asked = checks.names(where, given)
    words = [_word(text, of_code) for text in asked]
    unknown = [text for text, word in zip(asked, words, strict=True) if word not in NEEDS]
    if unknown:
        raise ValueError(f"{where}: expected some of {', '.join(NEEDS)}, got {', '.join(unknown)}")
    return tuple(word for word in NEEDS if word in words)


def _word(text: str, of_code: dict[str, str]) -> str:
    plain = text.strip().lower().replace("_", "-").replace(" ", "-")
    return of_code.get(text.strip(), ALIASES.get(plain, plain))


def lacking(needs: Iterable[str], codes: Iterable[str]) -> list[str]:
    """Return the words of `needs` that a law with these phenomena does not show."""
    shown = set(codes)
    return [word for word in needs if NEEDS[word][0] not in shown]


EASY = ("level", "viscous", "velocity scale", "load", "geometry", "temperature")
"""Roles of parameters that a pull test and steady sliding give."""
NUMERICAL = ("width", "sampling")
"""Roles of parameters that are chosen, not measured."""
SHARP = 1e-9
"""Widths [m/s] below this are none for an optimiser or a fixed step."""
EVENT = "event"
"""Form of laws with modes, and the class of what switches by events."""
CLASSES = ("jumps", EVENT, "?", "C0", "C1", "C2", "C3", "C4", "C∞")
"""Classes in the velocity, the least smooth first."""
CORE, STEPS_ON_CORE = "m4f", 200
"""Core whose instructions are counted, over so many steps."""
STEP = 1e-3
"""Step [s] of the C; the count does not depend on it."""


def physical(law: Law) -> tuple[list[Parameter], tuple[str, ...]]:
    """Return the parameters that describe friction, and the names of those that are hard to
    measure.

    Hard are bristles (micrometres before break-away), times (dwell, lag) and shapes, which only a
    fit gives; what smooths a jump is chosen and is neither.
    """
    known = [p for p in parameters(law).values() if p.role not in NUMERICAL and not p.width]
    return known, tuple(p.name for p in known if p.role not in EASY)


def smoothness(law: Law) -> str:
    """Return the class in the velocity, as the numbers of `law` are.

    A law that is smooth only over a width says what it is without: "C∞ (C0 at v = 0 as v_eps -> 0)"
    with v_eps = 1e-15 m/s is C0. One that switches by events is of the class "event". A law of laws
    has the least of theirs, and "?" is what does not say.
    """
    if form(law) == EVENT:
        return EVENT
    inside = getattr(law, "laws", None) or [x for x in vars(law).values() if isinstance(x, Law)]
    if inside:
        return min(map(smoothness, inside), key=CLASSES.index)
    said = law.facts.smoothness
    first = said.split()[0]
    if first.startswith("set"):
        return "jumps"
    eps = parameters(law).get("v_eps")
    sharp = eps is not None and float(eps.value) < SHARP  # pyright: ignore[reportArgumentType]
    if sharp and "(C0" in said:
        return "C0"
    found = first.strip(",;")
    return found if found in CLASSES else "?"


def form(law: Law) -> str:
    """Return the form that `law` was given in place of the one that it comes in; "" for that."""
    chosen = options(law).get("form")
    return chosen.value if chosen is not None and chosen.value != chosen.default else ""


def forms(law: Law) -> tuple[Law, ...]:
    """Return `law` with its modes switched by events, where it has that form, and as it is.

    The first is the one to try first: the exact one, if a controller can take it, too.
    """
    chosen = options(law).get("form")
    if chosen is None or EVENT not in chosen.choices or chosen.value == EVENT:
        return (law,)
    exact = replace(law, **{chosen.name: EVENT})
    return (law, exact) if c_operations(exact)[0] is None else (exact, law)


def is_smooth(row_class: str) -> bool:
    """Test for exact second derivatives, which optimal control needs."""
    return row_class in ("C2", "C∞")


def steepness(law: Law, speed: float) -> float:
    """Largest slope of the force over velocity, relative to the level at `speed` [s/m].

    Of laws with states that at rest, where a bristle carries: stiffness is no slope over velocity,
    and the number is NaN; so it is for laws that need more than v and N.
    """
    if law.states or law.inputs:
        return float("nan")
    v = np.concatenate([[0.0], np.geomspace(1e-14, speed, 6001)])
    F = steady_force(law, v, 1.0)
    slope = np.abs(np.diff(F) / np.diff(v)).max() / abs(float(F[-1])) if F[-1] else np.nan
    return float(slope) if isfinite(slope) else float("nan")


def c_operations(law: Law) -> tuple[int | None, str]:
    """Operations of the law's step in C, float, parameters constant; or why it has none."""
    try:
        block = law_block(law, h=STEP if law.states else None, free=())
        steps = [r for r in routines(CBlock(block, REALS["float"])) if _is_step(r.name)]
    except ValueError as problem:
        return None, str(problem)
    return sum(r.operations + sum(r.calls.values()) for r in steps), ""


def on_core(law: Law) -> tuple[float, str]:
    """Instructions of the law's step on a Cortex-M4F; NaN and why where it was not measured."""
    try:
        block = law_block(law, h=STEP if law.states else None, free=())
        found = measure(block, "float", CORE, steps=STEPS_ON_CORE)
    except (ValueError, CompileError) as problem:
        return nan, " ".join(str(problem).split())
    return found.average, "" if found.ok else found.status


def _is_step(name: str) -> bool:
    return not name.endswith(("_init", "_reset", "_init_sliding"))


def otherwise(law: Law, friction: Friction, load: float | None) -> str:
    """Return why `law` may differ from dry friction at any smoothing; "" if no reason is known.

    A static law whose steady friction is another one, a bristle that nothing damps, one that ages.
    """
    roles = {p.role for p in parameters(law).values() if p.value != 0.0}
    if law.states:
        times = [p.name for p in parameters(law).values() if p.role == "time" and p.unit == "s"]
        if times:
            return f"friction follows by times of its own ({', '.join(times)})"
        bristle = roles & {"stiffness", "length"} and "damping" not in roles
        return "nothing damps its bristle, which rings" if bristle else ""
    if law.inputs:
        return ""
    level = float(steady_force(law, np.array([FAST]), load or 1.0)[0]) / (load or 1.0)
    wanted = friction.sliding(FAST)
    if abs(level - wanted) <= ANOTHER * wanted:
        return ""
    return f"sliding at {FAST:g} m/s it rubs with {level:.3g} of the load, not {wanted:.3g}"


FAST, ANOTHER = 0.1, 0.05
"""Velocity [m/s] at which friction is that of sliding, and how far it may be another."""


def shown(codes: Sequence[str]) -> str:
    """Codes of phenomena as one word, by which laws are grouped: the hardest to have."""
    for code, word in GROUPS.items():
        if code in codes:
            return word
    return "sliding"


GROUPS = {
    "M": "memory",
    "P": "presliding",
    "St": "Stribeck",
    "S": "stiction",
}
"""Code -> group of laws in pictures."""
