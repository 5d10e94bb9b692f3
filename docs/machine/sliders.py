"""Sliders of a law's page: its curves as JavaScript, and what the sliders move.

The browser evaluates the functions of `functions`; `docs/static/sliders.js` draws their results.
"""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from math import inf, isfinite
from pathlib import Path
from typing import Any, final

import casadi as ca
import numpy as np

from docs.machine.markdown import TEXTS
from symfric import any_from_text, parameters, simulate
from symfric.codegen import plant_block
from symfric.emitter.c99 import filled
from symfric.emitter.javascript import LIBRARY, script
from symfric.figures.motion import NORMAL_FORCE, scales
from symfric.figures.pictures import window
from symfric.foundation.parameters import Parameter, symbolise
from symfric.foundation.variable import Variable, symbols_of
from symfric.integrator.methods.tableaux import METHODS
from symfric.laws import Law
from symfric.laws.base import smooth
from symfric.model import Model, Output
from symfric.scenes import Rabinowicz, contact

HERE = Path(__file__).parent
STATIC = HERE.parent / "static"
SHARED = (STATIC / "sliders.js", STATIC / "sliders.css")
"""Files that all pages with sliders load."""
PAGE = HERE / "sliders.html"
TEXT = f"{PAGE.read_text('utf-8')}{LIBRARY}{TEXTS['sliders']}"
"""Texts of all pages with sliders."""
MOST = 60_000
"""Largest size of the sliders of a page with the files that they load [bytes]."""
CHOICES = (
    ("rodas3", 1), ("rodas3", 4), ("exponential", 4), ("rodas4p", 4), ("exponential", 16),
    ("radau5", 4),
)  # fmt: skip
"""Methods, each with the number of its steps in a step of the drawn curve."""
SMALL = 1e-3
"""Largest relative error of a run, if one of `CHOICES` is that accurate."""
PERIODS, FREQUENCY, STEPS = 2, 1.0, 2000
"""Periods of the sinusoidal motion, its frequency [Hz], and drawn points of each period."""
PLAIN = ("level", "shape")
"""Roles of parameters whose sliders are linear."""
SLIDES = 3.0
"""Time at which a block with a stiffer spring begins to slide [s]."""
STEP = 1e-3
"""Time between drawn points of the block on the belt [s]."""
SAID = TEXTS["sliders"]


def steady(law: Law) -> ca.Function:
    """Return the function (v, N and further inputs; parameters) -> force in steady sliding."""
    symbolic, chosen = symbolise(law, *parameters(law))
    motion = ca.SX.sym("motion", 2 + len(law.inputs))
    v, N, *given = ca.vertsplit(motion)
    inputs = _ahead(law, v, given)
    force = symbolic.force(v, N, symbolic.steady_state(v, N), **inputs)
    return ca.Function("steady", [motion, symbols_of(chosen)], [ca.densify(ca.SX(force))])


def _ahead(law: Law, v: ca.SX, given: Iterable[ca.SX]) -> dict[str, Any]:
    """Return the further inputs, which point in the direction of sliding if the law is odd."""
    ahead = smooth.sign(v, 0.0) if law.facts.odd else 1.0
    return {i.name: value * ahead for i, value in zip(law.inputs, given, strict=True)}


def loop(law: Law) -> Model:
    """Return the model of a contact that moves by x = A sin(omega t) from relaxed states.

    Its parameters are A, omega, N, further inputs, and those of the law. A law that needs the
    sliding acceleration gets that of this motion.
    """
    symbolic, chosen = symbolise(law, *parameters(law))
    A = Variable("A", "m", start=3 * _stretch(law))
    omega = Variable("omega", "rad/s", start=2 * np.pi * FREQUENCY)
    N = Variable("N", "N", start=NORMAL_FORCE)
    given = [Variable(f"in_{i.name}", i.unit, i.steady) for i in law.inputs]
    t = ca.SX.sym("t")
    v = A.symbol * omega.symbol * ca.cos(omega.symbol * t)
    inputs = _ahead(law, v, [u.symbol for u in given])
    inputs["dv"] = ca.jacobian(v, t)
    slip = contact("slide", symbolic, v, N.symbol, rest={}, **inputs)
    first = law.steady_state(0.0, NORMAL_FORCE)
    states = tuple(replace(s, start=float(first[k])) for k, s in enumerate(slip.states))
    return Model(
        "loop",
        x=(Variable("x", "m"), *states),
        p=_numbered((A, omega, N, *given, *chosen)),
        ode=ca.vertcat(v, slip.rate),
        events=slip.events(),
        outputs={"v_rel": Output(v, "m/s"), "friction": Output(slip.friction, "N")},
        t=t,
    )


def _stretch(law: Law) -> float:
    """Return the pre-sliding distance, or else that of a second at the Stribeck velocity [m]."""
    found = scales(law)
    return found.stretch if isfinite(found.stretch) else found.velocity


def block(law: Law) -> Rabinowicz:
    """Return the block on the belt, with a stiffer spring if it would stick to the end of a run."""
    usual = Rabinowicz(law)
    slides = scales(law).static / (usual.k * usual.v_belt)  # time [s]
    return usual if slides < usual.t_end else replace(usual, k=usual.k * slides / SLIDES)


def belt(law: Law) -> Model:
    """Return the model of `block` with the parameters m, k, v_belt and those of the law.

    Raises:
        ValueError: the scene does not accept the law.
    """
    scene = block(law)
    model = scene.model(name for name in parameters(scene) if name != "g")
    return replace(model, p=_numbered(model.p))


def _numbered(given: Iterable[Variable]) -> tuple[Variable, ...]:
    """Return variables with other names, since `BoucWen` has a parameter A, as the motion has."""
    return tuple(replace(v, name=f"given_{k}") for k, v in enumerate(given))


@final
@dataclass(frozen=True)
class Run:
    """Run of a model by fixed steps in the browser.

    Attributes:
        step: function (states, parameters and h, no inputs) -> states and outputs after the step.
        start: initial states.
        h: step [s].
        method: name of the method.
        error: largest difference of `signal` to an adaptive run, relative to its peak.
    """

    step: ca.Function
    start: tuple[float, ...]
    h: float
    method: str
    error: float


def run(model: Model, end: float, h: float, signal: str) -> Run:
    """Return the first run of `CHOICES` whose error is at most `SMALL`, else the most accurate."""
    every = h * np.arange(1, round(end / h) + 1)
    exact = simulate(model, end, t_eval=every, rtol=1e-9)[signal]
    found: list[Run] = []
    for method, parts in CHOICES:
        block = plant_block(model, method=method)
        rows = [*(v.name for v in block.states), *block.outputs]
        start = [float(v.start) for v in block.states]
        p = [float(v.start) for v in model.p] + [h / parts]
        count = parts * every.size
        steps = block.step.mapaccum("run", count)
        made = ca.vertcat(*steps(start, ca.repmat(ca.DM(p), 1, count), ca.DM(0, count))).full()
        off = np.abs(made[rows.index(signal), parts - 1 :: parts] - exact).max()
        error = float(off / np.abs(exact).max())
        found.append(Run(block.step, tuple(start), h / parts, METHODS[method].name, error))
        if error <= SMALL:
            return found[-1]
    return min(found, key=lambda one: np.nan_to_num(one.error, nan=inf))


def runs(law: Law) -> tuple[dict[str, Run], dict[str, str]]:
    """Return the runs of a page by name, and the reason for each that is missing."""
    others = ", ".join(f"{i.name} ({i.doc})" for i in law.inputs if i.name != "F_e")
    if law.switches(0.0, 1.0, np.zeros(len(law.states))):
        return {}, dict.fromkeys(("loop", "belt"), SAID["events"])
    found, missing = dict[str, Run](), dict[str, str]()
    if any(i.name == "F_e" for i in law.inputs):
        missing["loop"] = SAID["applied"]
    else:
        found["loop"] = run(loop(law), PERIODS / FREQUENCY, 1 / (FREQUENCY * STEPS), "friction")
    if others:
        missing["belt"] = SAID["inputs"].format(others=others)
    else:
        found["belt"] = run(belt(law), Rabinowicz.t_end, STEP, "x")
    return found, missing


def scripts(made: Mapping[str, ca.Function]) -> str:
    """Return functions as JavaScript, with those that they call."""
    own = "".join(script(function, name) for name, function in made.items())
    return "\n".join(line.strip() for line in (LIBRARY + own).splitlines())


def slider(
    name: str, p: Parameter | Variable, value: float, role: str, size: float = 1.0
) -> dict[str, Any]:
    """Return a slider: a logarithmic one for positive magnitudes, else one of the numbers around.

    Args:
        size: typical magnitude of a parameter whose value is 0.
    """
    low, high = float(p.lower), float(p.upper)
    closed = isfinite(low) and isfinite(high)
    log = value > 0 and (0 < 100 * low <= high < inf if closed else low >= 0 and role not in PLAIN)
    if log and not closed:
        low, high = max(low, value / 100), 100 * value
    elif not closed:
        reach = 3 * abs(value) or size
        low, high = max(low, min(0.0, value - reach)), min(high, max(reach, value))
    about = {"name": name, "unit": "" if p.unit == "1" else p.unit, "doc": p.doc}
    return about | {"value": value, "low": low, "high": high, "log": log}


def described(law: Law) -> dict[str, Any]:
    """Return what `sliders.js` needs to know about a law."""
    static, wide, known = scales(law).static, window(law, NORMAL_FORCE), parameters(law)
    viscous = {"N s/m": static / (5 * wide), "s/m": static / NORMAL_FORCE / (5 * wide)}
    machine = parameters(block(law))
    moved = [
        (Variable("N", "N", lower=0.0, doc="normal force; on the belt it is m g"), NORMAL_FORCE),
        (Variable("A", "m", lower=0.0, doc="amplitude of the motion"), 3 * _stretch(law)),
        (Variable("f", "Hz", lower=0.0, doc="frequency of the motion"), FREQUENCY),
    ]
    given = ((Variable(i.name, i.unit, doc=i.doc), i) for i in law.inputs)
    pairs = [[*pair, strict] for strict in (0, 1)
             for pair in (law.strictly_ordered if strict else law.ordered)]  # fmt: skip
    return {
        "law": [slider(n, p, float(p.value), p.role, viscous.get(p.unit, 1.0))
                for n, p in known.items()],
        "inputs": [slider(i.name, v, i.steady, "level", i.nominal) for v, i in given],
        "contact": [slider(v.name, v, value, "load") for v, value in moved],
        "belt": [slider(n, machine[n], float(machine[n].value), "mass")
                 for n in ("m", "k", "v_belt")],
        "ordered": pairs, "window": wide, "periods": PERIODS, "points": STEPS, "step": STEP,
        "end": Rabinowicz.t_end,
        "turning": any(p.unit.startswith("rad/s") for p in known.values()),
    }  # fmt: skip


def written(name: str, law: Law) -> str:
    """Return the sliders of a page as HTML.

    Raises:
        ValueError: they are larger than `MOST`.
    """
    found, missing = runs(law)
    about = described(law) | {
        "missing": missing,
        "runs": {
            n: {"start": r.start, "h": r.h, "method": r.method, "error": float(f"{r.error:.1e}")}
            for n, r in found.items()
        },
    }
    made = {"steady": steady(law)} | {n: r.step for n, r in found.items()}
    values = {"law": name, "about": json.dumps(about), "functions": scripts(made)}
    text = filled(PAGE, **values)
    size = len(text.encode()) + sum(path.stat().st_size for path in SHARED)
    if size > MOST:
        raise ValueError(f"sliders of {name}: expected at most {MOST} bytes, got {size}")
    return text


def draw_sliders(name: str, folder: Path) -> None:
    """Write the sliders of a law into a folder; nothing for a population of contacts."""
    law = any_from_text(name)
    if isinstance(law, Law):
        (folder / f"{name}.html").write_text(written(name, law), "utf-8")
