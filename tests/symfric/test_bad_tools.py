"""Bad Python input at optimal control and C."""

from collections.abc import Iterator
from typing import Any

import casadi as ca
from bad_values import (
    INF,
    NAN,
    Door,
    Thing,
    choice,
    every_door_refuses,
    flag,
    function,
    number,
    path,
    thing,
    values,
)

import ocp
import symfric as sf
from symfric.codegen import generate, law_block, plant_block, verify
from symfric.laws import BrownMcPhee, Coulomb, LuGre, Stribeck


def doors_of_control() -> Iterator[Door]:
    model = sf.drive(BrownMcPhee(), free=["m"])
    good = {
        "model": model,
        "T": 1.0,
        "cost": ocp.integral(lambda s: s.force**2),
        "start": {"x": 0.0, "v": 0.0},
        "end": {"x": 0.1, "v": 0.0},
    }

    def moved(model: sf.Model, T: float, cost: ocp.Cost, **more: Any) -> ocp.Problem:
        return ocp.Problem(ocp.Phase(model, T, **more), cost)

    ranges = [
        3,
        "x",
        [("x", 1)],
        Thing(),
        {"nonsense": 1.0},
        {3: 1.0},
        {"x": None},
        {"x": "1"},
        {"x": NAN},
        {"x": INF},
        {"x": [0.0, 1.0, 2.0]},
        {"x": (1.0, 0.0)},
        {"x": (0.0,)},
        {"x": (NAN, 1.0)},
        {"x": True},
        {"x": 1j},
        {"x": Thing()},
        {"x": (0.0, "a")},
        True,
    ]
    yield Door(
        "Problem",
        moved,
        good,
        {
            "model": thing(BrownMcPhee(), sf.Model),
            "T": [*number(0.0, -1.0), (0.5, 1.0)],
            "cost": [
                None,
                3,
                "x",
                Thing(),
                lambda s: s.x,
                ocp.integral(lambda s: s.nonsense),
                ocp.integral(lambda s: "a"),
                ocp.integral(lambda s: None),
                ocp.integral,
                ocp.integral(lambda s: s.t * 0),
                ocp.integral(lambda: 1),
                ocp.integral(lambda s: ca.vertcat(s.x, s.x)),
                ocp.integral(lambda s: NAN),
                ocp.integral(lambda s: ca.SX.sym("a")),
                ocp.integral(lambda s: ca.MX.sym("a")),
            ],
            "start": ranges,
            "end": ranges,
            "bounds": ranges,
            "via": [
                3,
                "x",
                {"a": {}},
                {0.5: 3},
                {0.5: {"x": None}},
                {0.0: {}},
                {1.5: {}},
                {NAN: {}},
                {None: {}},
                {0.5: {"nonsense": 1.0}},
                Thing(),
                [0.5],
                {True: {}},
            ],
            "p": values("m", {"m": -1.0}),
        },
    )
    yield Door(
        "Free",
        ocp.Free,
        {"lower": 0.1, "upper": 1.0},
        {
            "lower": number(0.0, -1.0, 2.0),
            "upper": number(0.0, 0.05),
            "guess": number(5.0, optional=True),
        },
    )
    for make in (ocp.integral, ocp.at_end):
        yield Door(make.__name__, make, {}, {"expression": [None, *function()]})
    yield Door("Cost * weight", lambda w: ocp.TIME * w, {}, {"w": number()})
    yield Door(
        "rest_to_rest",
        ocp.rest_to_rest,
        {"model": model, "distance": 0.1, "T": 1.0, "limit": 9.0},
        {
            "model": thing(),
            "distance": number(),
            "T": number(0.0),
            "limit": number(0.0, -1.0),
            "position": choice(),
            "velocity": choice(),
            "force": choice(),
        },
    )
    problem = moved(**good)
    fast = {
        "problem": problem,
        "intervals": 4,
        "friction": "smooth",
        "verify": False,
        "solver": ocp.Ipopt(max_iter=1),
        "throw": False,
    }
    yield Door(
        "solve",
        ocp.solve,
        fast,
        {
            "problem": thing(model, ocp.Problem),
            "intervals": [
                "4",
                0,
                -1,
                2.5,
                NAN,
                [],
                [0.0],
                [0.0, 0.5],
                [0.0, 0.5, 0.5, 1.0],
                {},
                [0.0, NAN, 1.0],
                Thing(),
                True,
                1j,
                10**9,
            ],
            "scheme": [3, "radau", Thing(), ocp.Radau],
            "friction": choice(),
            "starts": [0, 2.5, "a", None],
            "max_time": number(0.0, -1.0, optional=True),
            "guess": [
                3,
                "x",
                {"nonsense": 1.0},
                {"x": "a"},
                {"x": NAN},
                {"x": [[1.0]]},
                {"x": []},
                {"x": lambda: 1},
                {"x": lambda t: "a"},
                {"x": lambda t: [1.0, 2.0]},
                Thing(),
                {"x": None},
                {"x": 1j},
                {3: 1.0},
                True,
            ],
            "solver": [3, "ipopt", Thing(), ocp.Ipopt, ocp.Ipopt(nonsense=1)],
            "verify": flag(),
            "throw": flag(),
            "progress": function(),
            "tolerance": number(0.0, -1.0),
        },
    )


def doors_of_code() -> Iterator[Door]:
    yield Door(
        "generate",
        generate,
        {"law": Stribeck(), "out": "c"},
        {
            "law": thing(Coulomb, sf.rabinowicz(LuGre())),
            "out": path(),
            "name": [3, "a b", "1a", "for", Thing(), [], ""],
            "real": [None, 3, "half", ["half"], [], Thing(), [3]],
            "free": [3, "mu_s", ["nonsense"], [3], Thing()],
        },
    )
    yield Door(
        "law_block",
        law_block,
        {"law": LuGre()},
        {
            "law": thing(LuGre),
            "h": number(0.0, -1.0, optional=True),
            "free": [3, "mu_s", ["nonsense"], [3], Thing()],
            "name": [3, "a b", Thing(), ""],
        },
    )
    yield Door(
        "plant_block",
        plant_block,
        {"model": sf.rabinowicz(BrownMcPhee())},
        {
            "model": thing(LuGre()),
            "h": number(0.0, -1.0, optional=True),
            "method": choice(),
            "name": [3, "a b", Thing(), ""],
        },
    )
    yield Door("verify", verify, {}, {"generated": thing()})


test_every_door_refuses_bad_input_in_a_sentence = every_door_refuses(
    {
        "control": doors_of_control,
        "code": doors_of_code,
    }
)
