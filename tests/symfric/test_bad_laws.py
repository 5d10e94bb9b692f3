"""Bad numbers and kinds at laws, scenes and figures: refused in one sentence."""

from collections.abc import Iterator
from dataclasses import fields
from typing import Any

from bad_values import (
    INF,
    NAN,
    Door,
    Thing,
    choice,
    count,
    every_door_refuses,
    names,
    number,
    parameter,
    path,
    thing,
    values,
)

import symfric as sf
from symfric.figures import FIGURES, compare, figure
from symfric.laws import BrownMcPhee, Coulomb, LuGre, Stribeck
from symfric.laws.catalogue import ALL_LAWS, POPULATIONS, WRAPPERS
from symfric.model import Model
from symfric.scenes import ALL_SCENES, Rabinowicz


def belt() -> Model:
    return sf.rabinowicz(BrownMcPhee(), free=["mu_d"])


def doors_of_laws() -> Iterator[Door]:
    for kind in (ALL_LAWS | POPULATIONS).values():
        bad: dict[str, list[Any]] = {}
        for item in fields(kind):
            if "unit" in item.metadata:
                more = [item.metadata["lower"] - 1.0, item.metadata["upper"] + 1.0]
                bad[item.name] = parameter(*(x for x in more if abs(x) < INF))
            elif "choices" in item.metadata:
                bad[item.name] = choice()
        yield Door(kind.__name__, kind, {}, bad)
    yield Door("Sum", sf.Sum, {}, {"laws": [*thing(), (), (Coulomb(),), (Coulomb(), 3), Coulomb()]})
    yield Door(
        "Asymmetric",
        sf.Asymmetric,
        {"positive": Coulomb(), "negative": Coulomb()},
        {
            "positive": thing(Coulomb, Stribeck()),
            "negative": thing(Coulomb, LuGre()),
            "v_blend": parameter(0.0, -1.0),
        },
    )
    for name, wrapper in WRAPPERS.items():
        yield Door(name, wrapper, {"law": Stribeck()}, {"law": thing(Coulomb)})
    yield Door("GMS", sf.GMS, {}, {"elements": [*thing(), (), (3,), (sf.Element,)]})
    yield Door("MaxwellSlip", sf.MaxwellSlip, {}, {"elements": [*thing(), (), (3,), (sf.Slider,)]})
    yield Door(
        "Table",
        sf.Table,
        {"speeds": (0.0, 1.0), "coefficients": (0.2, 0.1)},
        {
            "speeds": [*thing(), (0.0,), (1.0, 0.0), (0.0, NAN), ("a", "b"), (-1.0, 1.0)],
            "coefficients": [*thing(), (0.0,), (1.0, -1.0), (0.0, INF), ("a", "b")],
        },
    )
    for kind in (sf.GenericAsperity, sf.RandomBristles):
        bad = {"count": count(), "seed": [*number(-1), 1.5]}
        yield Door(kind.__name__, kind, {}, bad)
    rows = [None, 3.0, "ab", [], [0.0], [0.0, NAN], [[0.0, 1.0]], {}, Thing(), [1j, 2], ["a", "b"]]
    yield Door(
        "Population.force",
        sf.RandomBristles().force,
        {"t": [0.0, 1.0], "x": [0.0, 1.0], "N": 1.0},
        {"t": [*rows, [1.0, 0.0], [0.0, 0.0]], "x": rows, "N": number(-1.0)},
    )
    yield Door(
        "law_from_text",
        sf.law_from_text,
        {},
        {
            "text": [
                None,
                3,
                [],
                Thing(),
                "",
                "+",
                "lugre+",
                "nonsense",
                "lugre)",
                "lagged()",
                "lagged",
                "x" * 10_000,
                "lagged(" * 600 + "lugre" + ")" * 600,
                Coulomb,
            ],
        },
    )
    for query in (sf.law_name, sf.parameters):
        yield Door(query.__name__, lambda x, query=query: query(x), {}, {"x": thing(Coulomb)})
    yield Door(
        "with_values",
        sf.with_values,
        {"obj": LuGre(), "values": {}},
        {
            "obj": thing(LuGre),
            "values": [*values("mu_s")[:8], *({"mu_s": x} for x in parameter(-1.0))],
        },
    )
    yield Door("symbolise", lambda name: sf.symbolise(LuGre(), name), {}, {"name": choice()})
    yield Door("symbolise", lambda x: sf.symbolise(x, "mu_s"), {}, {"x": thing(LuGre)})


def doors_of_scenes() -> Iterator[Door]:
    for name, kind in ALL_SCENES.items():
        bad: dict[str, list[Any]] = {"law": thing(BrownMcPhee, "lugre", belt())}
        for item in fields(kind):
            if "unit" in item.metadata:
                low = item.metadata["lower"]
                bad[item.name] = parameter(*([low - 1.0] if low > -INF else []))
        yield Door(name, kind, {"law": BrownMcPhee()}, bad)
    for make in (sf.rabinowicz, sf.drive):
        yield Door(
            make.__name__,
            make,
            {"law": BrownMcPhee()},
            {
                "law": thing(BrownMcPhee, "lugre"),
                "free": names("mu_d"),
                "mu_d": parameter(-1.0),
                "nonsense": [1.0],
            },
        )
    yield Door("Scene.model", Rabinowicz(BrownMcPhee()).model, {}, {"free": names("mu_d")})


def doors_of_figures() -> Iterator[Door]:
    yield Door(
        "compare",
        compare,
        {"laws": [Coulomb()]},
        {
            "laws": [
                None,
                3,
                [],
                {},
                Thing(),
                [3],
                [None],
                ["nonsense"],
                {"a": 3},
                [Coulomb],
                "lugre",
                Coulomb(),
            ],
            "scenario": choice(),
            "N": number(0.0, -1.0),
        },
    )
    yield Door(
        "figure",
        figure,
        {"law": Coulomb(), "name": "profile"},
        {
            "law": thing(Coulomb),
            "name": choice(),
            "N": number(0.0, -1.0),
        },
    )
    for name, make in FIGURES.items():
        yield Door(name, make, {"law": LuGre()}, {"law": thing(LuGre), "N": number(0.0, -1.0)})
    data = compare([Coulomb()])
    yield Door("FigureData[]", lambda name: data[name], {}, {"name": choice()})
    yield Door("FigureData.plot", data.plot, {}, {"path": [*path(), "a.xyz", "."]})


test_every_door_refuses_bad_input_in_a_sentence = every_door_refuses(
    {
        "laws": doors_of_laws,
        "scenes": doors_of_scenes,
        "figures": doors_of_figures,
    }
)
