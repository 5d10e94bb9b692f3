"""Bad Python input: every public door refuses in one sentence, whatever it is given."""

from collections.abc import Iterator
from typing import Any

import casadi as ca
import numpy as np
from bad_values import (
    INF,
    NAN,
    Door,
    Thing,
    choice,
    count,
    every_door_refuses,
    flag,
    function,
    names,
    number,
    parameter,
    path,
    thing,
    times,
    values,
)

import symfric as sf
from symfric.laws import BrownMcPhee
from symfric.model import Event, Model, Monitor, Output
from symfric.scenes import Rabinowicz

QUICK = {"t_end": 0.01, "backend": "vm"}


def belt() -> Model:
    return sf.rabinowicz(BrownMcPhee(), free=["mu_d"])


def members(name: str) -> list[Any]:
    """As `values`, where arrays are good."""
    rows = ([0.1, NAN], [], [[0.1]], ["a"], [None], [True, False], [1j])
    return [x for x in values(name) if not (isinstance(x, dict) and np.ndim(x.get(name)))] + [
        {name: row} for row in rows
    ]


def doors_of_simulation() -> Iterator[Door]:
    model, driven = belt(), sf.drive(BrownMcPhee())
    common = {
        "model": thing(BrownMcPhee(), Rabinowicz(BrownMcPhee()), Model),
        "t_end": number(0.0, -1.0),
        "t_start": number(0.01, 5.0),
        "rtol": number(0.0, -1e-6, 1.0, 1e-20),
        "t_eval": times()[1:],
        "method": [*choice(), "backward_euler", "rodas5"],
        "backend": [*choice(), "gpu"],
        "max_steps": count(optional=True),
        "event_tolerance": number(0.0, -1.0),
        "u": values("force"),
    }
    yield Door(
        "simulate",
        sf.simulate,
        QUICK | {"model": model},
        {
            **common,
            "t_eval": times([0.0, 0.02], [-1.0, 0.0]),
            "x0": values("v", {"v": [0.1, 0.2]}),
            "p": values("mu_d", {"m": 1.0}),
            "u": values("nothing"),
            "atol": number(0.0, -1.0, optional=True),
            "samples": count(1),
            "sensitivities": names("mu_d"),
            "measure_error": flag(),
            "progress": function(),
            "throw": flag(),
        },
    )
    yield Door(
        "simulate, driven",
        sf.simulate,
        QUICK | {"model": driven},
        {
            "u": values(
                "force",
                {"force": lambda: 1.0},
                {"force": lambda t: "a"},
                {"force": lambda t: None},
                {"force": lambda t: ca.vertcat(t, t)},
                {"force": lambda t: __import__("math").sin(t)},
                {"force": lambda t: 1.0 if t > 0 else 0.0},
                {"force": lambda t: NAN},
                {"force": lambda t: ca.SX.sym("a")},
                {"force": lambda t: ca.MX.sym("a")},
                {"force": lambda t: [1.0, 2.0]},
                {"force": lambda t: 1j},
                {"force": lambda t: 1 / 0},
                {"force": sf.Hold},
            ),
        },
    )
    yield Door(
        "simulate_many",
        sf.simulate_many,
        QUICK | {"model": model, "executor": "serial"},
        {
            **common,
            "t_end": [bad for bad in parameter(-1.0) if not isinstance(bad, list)],  # of members
            "x0": members("v"),
            "p": members("mu_d"),
            "u": values("nothing"),
            "executor": [*choice(), "mpi"],
            "workers": count(optional=True),
            "chunk": count(optional=True),
            "real": choice(),
            "out": path(),
            "progress": function(),
        },
    )
    yield Door(
        "flow",
        sf.flow,
        {"model": model},
        {
            "model": thing(),
            "steps": count(),
            "method": choice(),
        },
    )
    peer = sf.integrator.simulate_by_peer
    yield Door(
        "simulate_by_peer",
        peer,
        {"model": model, "t_end": 0.01, "peer": "rosenbrock"},
        {
            **{k: v for k, v in common.items() if k in ("model", "t_end", "t_start", "rtol")},
            "peer": [*choice(), "vm"],
            "x0": values("v"),
            "p": values("mu_d"),
            "samples": count(1),
        },
    )
    bad_rows = [3.0, None, "ab", [NAN], [INF], [[0.0]], {}, Thing(), 1j, [None], ["a"], True]
    for kind in (sf.Hold, sf.Linear):
        yield Door(
            kind.__name__,
            kind,
            {"t": [0.0], "values": [1.0]},
            {
                "t": [*bad_rows, [], [0.0, 1.0]],
                # rows are of members of an ensemble
                "values": [*(bad for bad in bad_rows if bad != [[0.0]]), [], [0.0, 1.0]],
            },
        )
        yield Door(
            kind.__name__,
            kind,
            {"t": [0.0, 1.0], "values": [1.0, 2.0]},
            {
                "t": [[0.0, 0.0], [1.0, 0.0], [0.0, NAN]],
            },
        )


def doors_of_a_trajectory() -> Iterator[Door]:
    run = sf.simulate(belt(), 0.01, backend="vm", samples=5, sensitivities=["mu_d"])
    unordered = ([], [0.01, 0.005], [0.0, 0.0])  # fine here
    inside = [x for x in times([0.02], [-1.0], NAN, INF)[1:] if x not in unordered]
    yield Door("Trajectory.at", run.at, {}, {"times": inside})
    yield Door(
        "Trajectory.of",
        run.of,
        {"expression": 1.0},
        {
            "expression": [None, "v", Thing(), ca.SX.sym("a"), ca.MX.sym("a"), 1j, {}],
            "times": [x for x in inside if x is not None],
        },
    )
    yield Door(
        "Trajectory.integral",
        run.integral,
        {"name": "v"},
        {
            "name": choice(),
            "times": [x for x in inside if x is not None],
        },
    )
    yield Door("Trajectory[]", run.__getitem__, {}, {})
    yield Door("Trajectory[]", lambda name: run[name], {}, {"name": choice()})
    yield Door("Trajectory.gradient", run.gradient, {}, {"weights": values("v")})
    yield Door("Trajectory.to_csv", run.to_csv, {}, {"path": [*path(), "/dev/null", "."]})
    yield Door("Trajectory.to_csv", lambda name: run.to_csv("a.csv", name), {}, {"name": choice()})
    yield Door("Trajectory.to_json", run.to_json, {}, {"path": [*path(), "/dev/null", "."]})
    yield Door("Trajectory.plot", lambda name: run.plot(name), {}, {"name": choice()})
    yield Door("Trajectory.plot", run.plot, {}, {"path": [*path(), "a.xyz", "."]})
    yield Door("Trajectory.animate", run.animate, {"path": "a.gif"}, {"path": path()})
    yield Door("Trajectory.energy_balance", lambda x: run.energy_balance(), {}, {"x": [1]})


def doors_of_models() -> Iterator[Door]:
    x = sf.Variable("x", "m")
    good = {"name": "m", "x": (x,), "ode": -x.symbol}
    yield Door(
        "Variable",
        sf.Variable,
        {"name": "x", "unit": "m"},
        {
            "name": [None, 3, [], {}, Thing(), "", " "],
            "unit": [None, 3, [], Thing()],
            "start": ["0.1", [0.1], {}, Thing(), True, 1j, NAN, None, ca.SX.sym("s", 2)],
            "nominal": number(0.0, -1.0),
            "lower": ["0", [0.0], Thing(), NAN, True, 1j, INF, None],
            "upper": ["0", [0.0], NAN, True, 1j, -INF],
            "symbol": [3, "x", None, Thing(), ca.SX.sym("a", 2), ca.MX.sym("a"), ca.SX(3)],
        },
    )
    yield Door(
        "Model",
        Model,
        good,
        {
            "name": [None, 3, [], Thing()],
            "x": [3, "x", [3], (None,), Thing(), x, (x, x), (x.symbol,)],
            "z": [3, "x", (3,), Thing(), (x,), (sf.Variable("z", "m"),)],
            "u": [3, "x", (3,), Thing(), (x,)],
            "p": [3, "x", (3,), Thing(), (x,)],
            "ode": [
                None,
                "x",
                Thing(),
                {},
                ca.SX.sym("a"),
                ca.SX(2, 1),
                ca.MX.sym("a"),
                1j,
                lambda: 1,
            ],
            "alg": [None, "x", Thing(), ca.SX.sym("a"), ca.SX(2, 1), 1j],
            "outputs": [
                3,
                "x",
                [3],
                {"y": 3},
                {3: Output(x.symbol, "m")},
                {"y": None},
                Thing(),
                {"1y": Output(x.symbol, "m")},
                {"x": Output(x.symbol, "m")},
            ],
            "monitors": [3, "x", (3,), Thing(), Monitor(x.symbol, 1.0)],
            "events": [3, "x", (3,), Thing(), Event("e", x.symbol)],
            "t": [3, "t", None, Thing(), ca.SX.sym("t", 2), ca.MX.sym("t")],
        },
    )
    yield Door(
        "Output",
        lambda **a: Model(**good, outputs={"y": Output(**a)}),
        {"expression": x.symbol, "unit": "m"},
        {
            "expression": [
                None,
                "x",
                Thing(),
                {},
                1j,
                ca.SX.sym("a"),
                ca.SX.sym("a", 2),
                ca.MX.sym("a"),
                NAN,
                True,
            ],
            "unit": [None, 3, Thing()],
        },
    )
    yield Door(
        "Monitor",
        lambda **a: Model(**good, monitors=(Monitor(**a),)),
        {"expression": x.symbol, "nominal": 1.0},
        {
            "expression": [None, "x", Thing(), 1j, ca.SX.sym("a"), ca.MX.sym("a")],
            "nominal": number(0.0, -1.0),
        },
    )
    yield Door(
        "Event",
        lambda **a: Model(**good, events=(Event(**a),)),
        {"name": "e", "expression": x.symbol},
        {
            "name": [None, 3, Thing()],
            "expression": [
                None,
                "x",
                Thing(),
                1j,
                ca.SX.sym("a"),
                ca.SX.sym("a", 2),
                ca.MX.sym("a"),
            ],
            "direction": [None, "1", 2, 0.5, Thing(), True, [1], NAN],
            "terminal": flag(),
            "reset": [
                3,
                "x",
                [1],
                {"y": 1.0},
                {"x": None},
                {"x": "a"},
                {"x": ca.SX.sym("q")},
                {"x": ca.SX(2, 1)},
                {3: 1.0},
                Thing(),
                {"x": NAN},
                {"x": 1j},
            ],
        },
    )
    model = belt()
    yield Door("Model.function", model.function, {}, {"what": choice()})
    yield Door("Model.expression", model.expression, {}, {"name": choice()})
    yield Door(
        "Model.values",
        model.values,
        {"letter": "p"},
        {
            "given": values("mu_d"),
        },
    )
    yield Door(
        "Model.initial_state",
        model.initial_state,
        {},
        {
            "given": values("v"),
            "p": values("mu_d"),
        },
    )


test_every_door_refuses_bad_input_in_a_sentence = every_door_refuses(
    {
        "simulation": doors_of_simulation,
        "trajectory": doors_of_a_trajectory,
        "models": doors_of_models,
    }
)
