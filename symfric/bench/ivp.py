"""Correct digits and run time on published initial-value problems with known solutions.

The problems are read from `ivp_problems.toml`.
"""

import re
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from math import nan, pi
from pathlib import Path
from typing import Any, final

import casadi as ca
import numpy as np

from symfric.bench.report import Found, Progress, Report, backend, best_time, curves
from symfric.foundation.parameters import Variable
from symfric.integrator.simulate import simulate
from symfric.model import Model, Output
from symfric.multibody import JointSpringDamper, Mechanism, PointOnLine, Revolute, SpringDamper
from symfric.results.trajectory import Trajectory

TEST_SET = (
    "Mazzia and Magherini, Test Set for Initial Value Problem Solvers, release 2.4, "
    "University of Bari and INdAM, 2008"
)
DATA: dict[str, dict[str, Any]] = tomllib.loads(
    Path(__file__).with_name("ivp_problems.toml").read_text("utf-8")
)
FUNCTIONS: dict[str, Any] = {"sin": ca.sin, "cos": ca.cos, "exp": ca.exp, "sqrt": ca.sqrt, "pi": pi}


@final
@dataclass(frozen=True, eq=False)
class Problem:
    """Initial-value problem with its published solution at the end.

    Attributes:
        name: name in the literature.
        model: function that builds the equations.
        t_end: end time; the problem starts at 0.
        reference: signal -> published value at the end.
        digits: rtol -> required number of correct digits.
        drift: outputs that are zero on the exact solution: the constraints of a problem of higher
            index, which is solved in an index-reduced form.
        laborious: methods that need millions of steps below rtol 1e-6.
    """

    name: str
    model: Callable[[], Model]
    t_end: float
    reference: Mapping[str, float]
    digits: Mapping[float, int] = field(default_factory=lambda: {1e-6: 5, 1e-10: 9})
    drift: tuple[str, ...] = ()
    laborious: tuple[str, ...] = ()


def published(name: str) -> Problem:
    """Return a problem of the test set."""
    data = DATA[name]
    more: dict[str, Any] = {"laborious": tuple(data.get("laborious", ()))}
    if "digits" in data:
        more["digits"] = {float(rtol): digits for rtol, digits in data["digits"].items()}
    more["drift"] = tuple(f"c_{i}" for i, _ in enumerate(data.get("constraint", ()), start=1))
    make = mechanical if "constraint" in data else equations
    return Problem(name, partial(make, name), data["t_end"], data["end"], **more)


def values(data: Mapping[str, Any], symbols: Mapping[str, Any]) -> dict[str, Any]:
    """Return the symbols, the functions, and the definitions of a problem by name."""
    known = {**FUNCTIONS, **symbols}
    for name, text in data.get("let", {}).items():
        known[name] = evaluated(text, known) if isinstance(text, str) else text
    return known


def evaluated(text: str, known: Mapping[str, Any]) -> Any:
    """Return the value of an expression of the data file."""
    return eval(text, {"__builtins__": {}}, dict(known))


def column(texts: Iterable[str], known: Mapping[str, Any]) -> ca.SX:
    """Return the values of several expressions as a column."""
    return ca.vertcat(ca.SX(0, 1), *(evaluated(text, known) for text in texts))


def variables(names: Iterable[str], unit: str, start: Any, nominal: Any) -> tuple[Variable, ...]:
    """Return variables with their start and nominal values."""
    rows = zip(names, start, nominal, strict=True)
    return tuple(Variable(n, unit, start=float(s), nominal=float(size)) for n, s, size in rows)


def equations(name: str) -> Model:
    """Return a problem in explicit or implicit form."""
    data, t = DATA[name], ca.SX.sym("t")
    unit, count = data.get("unit", "1"), len(data["start"])
    x = variables((f"y{i + 1}" for i in range(count)), unit, data["start"], data["nominal"])
    z = variables(**data["z"]) if "z" in data else ()
    rates = {f"d{i + 1}": ca.SX.sym(f"d{i + 1}") for i in range(count)}
    known = values(data, {v.name: v.symbol for v in (*x, *z)} | rates | {"t": t})
    form: dict[str, Any] = {key: column(data[key], known) for key in ("ode", "alg") if key in data}
    if name == "Pleiades":
        form["ode"] = attraction([v.symbol for v in x])
    if "residual" in data:
        form = {"residual": column(data["residual"], known), "xdot": ca.vertcat(*rates.values())}
    return Model(identifier(name), x=x, z=z, t=t, **form)


def identifier(name: str) -> str:
    """Return the name of a problem as an identifier."""
    return re.sub(r"\W+", "_", name.lower())


def attraction(state: list[ca.SX]) -> ca.SX:
    """Return the velocities and accelerations of the seven stars of Pleiades."""
    x, y, velocities = state[:7], state[7:14], state[14:]

    def pull(along: list[ca.SX], i: int) -> ca.SX:
        """Return the acceleration of star i."""
        others = (j for j in range(7) if j != i)
        return sum(
            (
                (j + 1) * (along[j] - along[i]) / ((x[j] - x[i]) ** 2 + (y[j] - y[i]) ** 2) ** 1.5
                for j in others
            ),
            start=ca.SX(0),
        )

    return ca.vertcat(*velocities, *(pull(along, i) for along in (x, y) for i in range(7)))


def mechanical(name: str) -> Model:
    """Return a problem with constraints on its coordinates, which are imposed on accelerations."""
    data, t = DATA[name], ca.SX.sym("t")
    names, unit, zeros = data["names"], data["unit"], [0.0] * len(data["names"])
    multipliers = [f"lam_{i + 1}" for i, _ in enumerate(data["constraint"])]
    starts = (data["start"], data.get("rates", zeros), zeros, [0.0] * len(multipliers))
    kinds = (names, *([f"{n}_{end}" for n in names] for end in ("dot", "ddot")), multipliers)
    units = (unit, f"{unit}/s", f"{unit}/s^2", "N")
    groups = [
        variables(kind, of, start, [size] * len(kind))
        for kind, of, start, size in zip(kinds, units, starts, data["sizes"], strict=True)
    ]
    q, v, a, lam = (ca.vertcat(*(w.symbol for w in group)) for group in groups)
    known = values(data, {w.name: w.symbol for group in groups for w in group} | {"t": t})
    mass, c = ca.SX(len(names), len(names)), column(data["constraint"], known)
    for place, text in data["mass"].items():
        i, j = map(int, place.split())
        mass[i, j] = mass[j, i] = evaluated(text, known)

    def rate(of: ca.SX) -> ca.SX:
        """Return the total time derivative, including accelerations."""
        return ca.jacobian(of, q) @ v + ca.jacobian(of, v) @ a + ca.jacobian(of, t)

    balance = mass @ a - column(data["force"], known) - ca.jacobian(c, q).T @ lam
    outputs = {
        f"c_{i + 1}": Output(c[i], data["constraint_unit"]) for i, _ in enumerate(multipliers)
    }
    positions, velocities, accelerations, forces = groups
    return Model(
        identifier(name),
        x=(*positions, *velocities),
        z=(*accelerations, *forces),
        ode=ca.vertcat(v, a),
        alg=ca.vertcat(balance, rate(rate(c))),
        outputs=outputs,
        t=t,
    )


ANDREWS = published("Andrews' squeezer")


def mechanism() -> Mechanism:
    """Andrews' squeezer as a mechanism of bodies and joints.

    Seven bodies are attached to three pins of the ground; three pins at one point, E, close their
    loops. A motor drives the first hinge; a spring connects C and D.
    """
    data = DATA[ANDREWS.name]
    known = {n: x for n, x in data["let"].items() if not isinstance(x, str)}
    m = Mechanism("squeezer", gravity=(0.0, 0.0, 0.0))

    def place(texts: list[str]) -> tuple[float, float, float]:
        x, y = (float(evaluated(text, known)) for text in texts)
        return x, y, 0.0

    for k, (body, parts) in enumerate(data["bodies"].items(), start=1):
        m.body(body, known[f"M{k}"], (known[f"I{k}"],) * 3, com=place(parts["centre"]))
    for frame, texts in data["frames"].items():
        m.frame(frame, at=place(texts))
    for (body, parts), start in zip(data["bodies"].items(), data["start"], strict=True):
        m.joint(Revolute(parts["hinge"], parts["at"], body, start=start))
    for body in ("K3", "K4", "K6"):
        m.joint(PointOnLine(f"E_{body}", "K2.E", f"{body}.E"))
    m.force(JointSpringDamper("motor", "beta", actuator=known["TORQUE"]))
    ends = "ground.C", "K3.D"
    m.force(SpringDamper("spring", *ends, stiffness=known["C0"], free_length=known["L0"]))
    return m


JOINT = Problem(
    f"{ANDREWS.name}, joint coordinates", lambda: mechanism().build(), ANDREWS.t_end,
    ANDREWS.reference, drift=("constraint_position",),
)  # fmt: skip
PROBLEMS = (*(published(name) for name in DATA if name != "car axis"), JOINT, published("car axis"))
"""All problems of the benchmark."""


# ---- measurements ----

METHODS = ("rodas5p", "radau5")
TOLERANCES = (1e-6, 1e-8, 1e-10)
DIGITS = "Correct digits of the worst signal at the end"
DRIFT = "Drift of constraints that are imposed on the accelerations only"


def bench(
    quick: bool = False, problems: Sequence[Problem] = PROBLEMS, progress: Progress = None
) -> Report:
    """Measure all problems; with `quick`, at rtol 1e-6 only."""
    tasks = {problem.name: partial(_rows, problem, quick) for problem in problems}
    draw = curves("problem", ("method",), "relative error", "time per run [ms]")
    source = f"Problems and published values: {TEST_SET}."
    return Report((DIGITS, draw), notes=[source]).collect(tasks, progress)


def _rows(problem: Problem, quick: bool) -> Iterator[Found]:
    model = problem.model()
    for method in METHODS:
        tolerances = TOLERANCES[:1] if quick or method in problem.laborious else TOLERANCES
        for rtol in tolerances:
            yield from measure(problem, model, method, rtol)


def measure(
    problem: Problem, model: Model, method: str, rtol: float, engine: str | None = None
) -> Iterator[Found]:
    """Integrate one problem; yield the row of its correct digits and the row of its drift.

    Args:
        problem, model: problem and its equations.
        method, rtol: as in `simulate`.
        engine: `backend` of `simulate`; by default compiled if there is a compiler.
    """
    solve = partial(
        simulate, model, problem.t_end, rtol=rtol, method=method, backend=engine or backend(),
        samples=2, throw=False,
    )  # fmt: skip
    solve()
    time_s, run = best_time(solve)
    case = {"problem": problem.name, "method": method, "rtol": rtol}
    digits, worst = correct_digits(problem, run) if run.status.ok else (nan, "")
    yield DIGITS, case | {
        "correct digits": digits, "worst signal": worst,
        "required digits": problem.digits.get(rtol, ""), "relative error": 10**-digits,
        "steps": run.statistics.steps, "rejections": run.statistics.rejections,
        "time per run [ms]": 1e3 * time_s,
    }  # fmt: skip
    if not run.status.ok:
        yield f"{problem.name}, {method}: not run, {run.message}"
    if problem.drift and run.step_times.size > 1:
        at = run.at(run.step_times)
        drift = max(float(np.abs(at[name]).max()) for name in problem.drift)
        yield DRIFT, case | {"largest constraint violation": drift}


def correct_digits(problem: Problem, run: Trajectory) -> tuple[float, str]:
    """Return the number of correct digits of the worst signal at the end, and its name."""
    end = run.final
    errors = {
        name: abs(end[name] - value) / abs(value) for name, value in problem.reference.items()
    }
    worst = max(errors, key=lambda name: errors[name])
    # rounding limits the number of correct digits
    return -float(np.log10(max(errors[worst], float(np.finfo(float).eps)))), worst
