"""Properties of a law that need no simulation: phenomena, smoothness, parameters, cost in C."""

from collections.abc import Iterable
from dataclasses import replace
from math import isfinite, nan

import numpy as np

from symfric.choice.friction import Friction
from symfric.codegen.blocks.block import Block, CBlock
from symfric.codegen.blocks.from_law import law_block
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
"""Codes of `symfric.laws.PHENOMENA` and their meanings, by word."""

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
"""Synonyms of the words in `NEEDS`."""


def needed(where: str, given: object) -> tuple[str, ...]:
    """Return the words of `NEEDS` for `given`, a sequence of words, aliases or codes.

    The result is in the order of `NEEDS`.

    Raises:
        ValueError: a text instead of a sequence, or an unknown word; the message lists all words.
    """
    of_code = {code: word for word, (code, _) in NEEDS.items()}
    words: dict[str, str] = {}
    for text in checks.names(where, given):
        plain = text.strip().lower().replace("_", "-").replace(" ", "-")
        words[text] = of_code.get(text.strip(), ALIASES.get(plain, plain))
    if unknown := [text for text, word in words.items() if word not in NEEDS]:
        raise ValueError(f"{where}: expected some of {', '.join(NEEDS)}, got {', '.join(unknown)}")
    return tuple(word for word in NEEDS if word in words.values())


def lacking(needs: Iterable[str], codes: Iterable[str]) -> list[str]:
    """Return the words of `needs` that a law with these phenomena does not show."""
    shown = set(codes)
    return [word for word in needs if NEEDS[word][0] not in shown]


EASY = ("level", "viscous", "velocity scale", "load", "geometry", "temperature")
"""Roles of parameters that can be measured in a pull test and in steady sliding."""
NUMERICAL = ("width", "sampling")
"""Roles of parameters that are chosen, not measured."""
SHARP = 1e-9
"""Widths [m/s] that are too small to smooth a law for an optimiser or a fixed step."""
EVENT = "event"
"""Name of the form of laws with modes, and of their class of smoothness."""
CLASSES = ("jumps", EVENT, "?", "C0", "C1", "C2", "C3", "C4", "C∞")
"""Classes of smoothness in the velocity, with the least smooth first."""
CORE, STEPS_ON_CORE = "m4f", 200
"""Core on which instructions are counted, and the number of steps."""
STEP = 1e-3
"""Step size [s] of the generated C, on which the count does not depend."""


def physical(law: Law) -> tuple[list[Parameter], tuple[str, ...]]:
    """Return the parameters that describe friction, and the names of those hard to measure.

    Parameters of bristles (micrometres before break-away), times (dwell, lag) and shapes are hard
    to measure, since only a fit determines them. Widths that smooth a jump are not included.
    """
    known = [p for p in parameters(law).values() if p.role not in NUMERICAL and not p.width]
    return known, tuple(p.name for p in known if p.role not in EASY)


def smoothness(law: Law) -> str:
    """Return the class of smoothness in the velocity of `law` with its parameters.

    A law with a negligible width has the class that it states for zero width: "C∞ (C0 at v = 0 as
    v_eps -> 0)" with v_eps = 1e-15 m/s is C0. A law with events has the class "event". A law that
    contains laws has the least smooth of their classes. "?" stands for an unknown class.
    """
    if form(law) == EVENT:
        return EVENT
    inside = getattr(law, "laws", None) or [x for x in vars(law).values() if isinstance(x, Law)]
    if inside:
        return min(map(smoothness, inside), key=CLASSES.index)
    claim = law.facts.smoothness
    first = claim.split()[0].strip(",;")
    if first.startswith("set"):
        return "jumps"
    eps = parameters(law).get("v_eps")
    if eps is not None and float(eps.value) < SHARP and "(C0" in claim:  # pyright: ignore[reportArgumentType]
        return "C0"
    return first if first in CLASSES else "?"


def form(law: Law) -> str:
    """Return the form of `law`, or an empty string for the default form."""
    chosen = options(law).get("form")
    return chosen.value if chosen is not None and chosen.value != chosen.default else ""


def forms(law: Law) -> tuple[Law, ...]:
    """Return the form of `law` with events, if it has one, and the unchanged law.

    The form with events is first, unless no C can be generated from it.
    """
    chosen = options(law).get("form")
    if chosen is None or EVENT not in chosen.choices or chosen.value == EVENT:
        return (law,)
    exact = replace(law, **{chosen.name: EVENT})
    return (law, exact) if c_operations(exact)[0] is None else (exact, law)


def steepness(law: Law, speed: float) -> float:
    """Return the largest slope of the force over velocity, divided by the force at `speed` [s/m].

    Return NaN for laws with further inputs and for laws with states, whose force at rest depends on
    the displacement.
    """
    if law.states or law.inputs:
        return nan
    v = np.concatenate([[0.0], np.geomspace(1e-14, speed, 6001)])
    F = steady_force(law, v, 1.0)
    slope = np.abs(np.diff(F) / np.diff(v)).max() / abs(float(F[-1])) if F[-1] else nan
    return float(slope) if isfinite(slope) else nan


def _block(law: Law) -> Block:
    return law_block(law, h=STEP if law.states else None, free=())


def c_operations(law: Law) -> tuple[int | None, str]:
    """Return the operations of a step of the law in C, or None and the reason.

    The C is in single precision with constant parameters.
    """
    try:
        every = routines(CBlock(_block(law), REALS["float"]))
    except ValueError as problem:
        return None, str(problem)
    steps = [r for r in every if not r.name.endswith(("_init", "_reset", "_init_sliding"))]
    return sum(r.operations + sum(r.calls.values()) for r in steps), ""


def on_core(law: Law) -> tuple[float, str]:
    """Return the instructions of a step of the law on a Cortex-M4F, or NaN and the reason."""
    try:
        counted = measure(_block(law), "float", CORE, steps=STEPS_ON_CORE)
    except (ValueError, CompileError) as problem:
        return nan, " ".join(str(problem).split())
    return counted.average, "" if counted.ok else counted.status


FAST, ANOTHER = 0.1, 0.05
"""Velocity [m/s] of steady sliding, and the relative difference of friction that is reported."""


def otherwise(law: Law, friction: Friction, load: float | None) -> str:
    """Return a reason why `law` differs from dry friction at any smoothing; empty if unknown.

    Reasons are an undamped bristle, time constants, and a different level of steady sliding.
    """
    known = parameters(law).values()
    if law.states:
        times = [p.name for p in known if p.role == "time" and p.unit == "s" and p.value != 0.0]
        if times:
            return f"friction changes with time constants ({', '.join(times)})"
        roles = {p.role for p in known if p.value != 0.0}
        bristle = roles & {"stiffness", "length"} and "damping" not in roles
        return "its bristle is undamped" if bristle else ""
    if law.inputs:
        return ""
    level = float(steady_force(law, np.array([FAST]), load or 1.0)[0]) / (load or 1.0)
    wanted = friction.sliding(FAST)
    if abs(level - wanted) <= ANOTHER * wanted:
        return ""
    found = f"its friction is {level:.3g} of the load instead of {wanted:.3g}"
    return f"sliding at {FAST:g} m/s {found}"
