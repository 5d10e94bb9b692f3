"""Bad Python input: every public entry point refuses it in one sentence."""

from collections.abc import Iterator
from dataclasses import fields
from typing import Any

import casadi as ca
import numpy as np
from bad_values import (
    INF,
    NAN,
    EntryPoint,
    Thing,
    choice,
    count,
    each,
    entry_point,
    entry_points_refuse,
    expression,
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
from symfric.figures import FIGURES, compare, figure
from symfric.laws import BrownMcPhee, Coulomb, LuGre, Stribeck
from symfric.laws.catalogue import ALL_LAWS, POPULATIONS, WRAPPERS
from symfric.model import Event, Model, Monitor, Output
from symfric.scenes import ALL_SCENES, Rabinowicz

QUICK = {"t_end": 0.01, "backend": "vm"}


def belt() -> Model:
    return sf.rabinowicz(BrownMcPhee(), free=["mu_d"])


def members(name: str) -> list[Any]:
    """As `values`, where arrays are good."""
    rows = ([0.1, NAN], [], [[0.1]], ["a"], [None], [True, False], [1j])
    return [x for x in values(name) if not (isinstance(x, dict) and np.ndim(x.get(name)))] + [
        {name: row} for row in rows
    ]


def some_parameter(*more: Any) -> list[Any]:
    """A few values that are no parameter; all fields of laws and scenes share their checks."""
    return [None, "0.1", NAN, *more]


def entry_points_of_simulation() -> Iterator[EntryPoint]:
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
    yield entry_point(
        sf.simulate,
        QUICK | {"model": model},
        **common
        | {
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
    callables = (
        *(lambda: 1.0, lambda t: "a", lambda t: None, lambda t: ca.vertcat(t, t), sf.Hold),
        *(lambda t: __import__("math").sin(t), lambda t: 1.0 if t > 0 else 0.0, lambda t: NAN),
        *(lambda t: ca.SX.sym("a"), lambda t: ca.MX.sym("a"), lambda t: [1.0, 2.0]),
        *(lambda t: 1j, lambda t: 1 / 0),
    )
    yield entry_point(
        sf.simulate,
        QUICK | {"model": driven},
        "simulate, driven",
        u=values("force", *each("force", *callables)),
    )
    yield entry_point(
        sf.simulate_many,
        QUICK | {"model": model, "executor": "serial"},
        **common
        | {
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
    yield entry_point(sf.flow, {"model": model}, model=thing(), steps=count(), method=choice())
    peer = sf.integrator.simulate_by_peer
    yield entry_point(
        peer,
        {"model": model, "t_end": 0.01, "peer": "rosenbrock"},
        "simulate_by_peer",
        **{
            **{k: v for k, v in common.items() if k in ("model", "t_end", "t_start", "rtol")},
            "peer": [*choice(), "vm"],
            "x0": values("v"),
            "p": values("mu_d"),
            "samples": count(1),
        },
    )
    bad_rows = [3.0, None, "ab", [NAN], [INF], [[0.0]], {}, Thing(), 1j, [None], ["a"], True]
    for kind in (sf.Hold, sf.Linear):
        yield entry_point(
            kind,
            {"t": [0.0], "values": [1.0]},
            t=[*bad_rows, [], [0.0, 1.0]],
            values=[*(bad for bad in bad_rows if bad != [[0.0]]), [], [0.0, 1.0]],
        )
        yield entry_point(
            kind, {"t": [0.0, 1.0], "values": [1.0, 2.0]}, t=[[0.0, 0.0], [1.0, 0.0], [0.0, NAN]]
        )


def entry_points_of_a_trajectory() -> Iterator[EntryPoint]:
    run = sf.simulate(belt(), 0.01, backend="vm", samples=5, sensitivities=["mu_d"])
    unordered = ([], [0.01, 0.005], [0.0, 0.0])  # fine here
    inside = [x for x in times([0.02], [-1.0], NAN, INF)[1:] if x not in unordered]
    yield entry_point(run.at, times=inside)
    yield entry_point(
        run.of,
        {"expression": 1.0},
        expression=expression({}),
        times=[x for x in inside if x is not None],
    )
    yield entry_point(
        run.integral, {"name": "v"}, name=choice(), times=[x for x in inside if x is not None]
    )
    yield entry_point(lambda name: run[name], "Trajectory[]", name=choice())
    yield entry_point(run.gradient, weights=values("v"))
    yield entry_point(run.to_csv, path=[*path(), "/dev/null", "."])
    yield entry_point(lambda name: run.to_csv("a.csv", name), "Trajectory.to_csv", name=choice())
    yield entry_point(run.to_json, path=[*path(), "/dev/null", "."])
    yield entry_point(lambda name: run.plot(name), "Trajectory.plot", name=choice())
    yield entry_point(run.plot, path=[*path(), "a.xyz", "."])
    yield entry_point(run.animate, {"path": "a.gif"}, path=path())
    yield entry_point(lambda x: run.energy_balance(), "Trajectory.energy_balance", x=[1])


def entry_points_of_models() -> Iterator[EntryPoint]:
    x = sf.Variable("x", "m")
    good, output = {"name": "m", "x": (x,), "ode": -x.symbol}, Output(x.symbol, "m")
    yield entry_point(
        sf.Variable,
        {"name": "x", "unit": "m"},
        name=[None, 3, [], {}, Thing(), "", " "],
        unit=[None, 3, [], Thing()],
        start=["0.1", [0.1], {}, Thing(), True, 1j, NAN, None, ca.SX.sym("s", 2)],
        nominal=number(0.0, -1.0),
        lower=["0", [0.0], Thing(), NAN, True, 1j, INF, None],
        upper=["0", [0.0], NAN, True, 1j, -INF],
        symbol=[3, "x", None, Thing(), ca.SX.sym("a", 2), ca.MX.sym("a"), ca.SX(3)],
    )
    collection = [3, "x", (3,), Thing(), (x,)]
    yield entry_point(
        Model,
        good,
        name=[None, 3, [], Thing()],
        x=[3, "x", [3], (None,), Thing(), x, (x, x), (x.symbol,)],
        z=[*collection, (sf.Variable("z", "m"),)],
        u=collection,
        p=collection,
        ode=expression({}, ca.SX(2, 1), lambda: 1),
        alg=expression(ca.SX(2, 1))[1:],
        outputs=[*collection[:-1], *each("y", 3, None), *({n: output} for n in (3, "1y", "x"))],
        monitors=[*collection[:-1], Monitor(x.symbol, 1.0)],
        events=[*collection[:-1], Event("e", x.symbol)],
        t=[3, "t", None, Thing(), ca.SX.sym("t", 2), ca.MX.sym("t")],
    )
    yield entry_point(
        lambda **a: Model(**good, outputs={"y": Output(**a)}),
        {"expression": x.symbol, "unit": "m"},
        "Output",
        expression=expression({}, ca.SX.sym("a", 2), NAN, True),
        unit=[None, 3, Thing()],
    )
    yield entry_point(
        lambda **a: Model(**good, monitors=(Monitor(**a),)),
        {"expression": x.symbol, "nominal": 1.0},
        "Monitor",
        expression=expression(),
        nominal=number(0.0, -1.0),
    )
    values_of_reset = (None, "a", ca.SX.sym("q"), ca.SX(2, 1), NAN, 1j)
    yield entry_point(
        lambda **a: Model(**good, events=(Event(**a),)),
        {"name": "e", "expression": x.symbol},
        "Event",
        name=[None, 3, Thing()],
        expression=expression(ca.SX.sym("a", 2)),
        direction=[None, "1", 2, 0.5, Thing(), True, [1], NAN],
        terminal=flag(),
        reset=[3, "x", [1], {"y": 1.0}, {3: 1.0}, Thing(), *each("x", *values_of_reset)],
    )
    model = belt()
    yield entry_point(model.function, what=choice())
    yield entry_point(model.expression, name=choice())
    yield entry_point(model.values, {"letter": "p"}, given=values("mu_d"))
    yield entry_point(model.initial_state, given=values("v"), p=values("mu_d"))


def entry_points_of_laws() -> Iterator[EntryPoint]:
    for kind in (ALL_LAWS | POPULATIONS).values():
        bad, every = dict[str, list[Any]](), parameter if kind is LuGre else some_parameter
        for item in fields(kind):
            if "unit" in item.metadata:
                more = [item.metadata["lower"] - 1.0, item.metadata["upper"] + 1.0]
                bad[item.name] = every(*(x for x in more if abs(x) < INF))
            elif "choices" in item.metadata:
                bad[item.name] = choice()
        yield entry_point(kind, **bad)
    yield entry_point(sf.Sum, laws=[*thing(), (), (Coulomb(),), (Coulomb(), 3), Coulomb()])
    yield entry_point(
        sf.Asymmetric,
        {"positive": Coulomb(), "negative": Coulomb()},
        positive=thing(Coulomb, Stribeck()),
        negative=thing(Coulomb, LuGre()),
        v_blend=parameter(0.0, -1.0),
    )
    for name, wrapper in WRAPPERS.items():
        yield entry_point(wrapper, {"law": Stribeck()}, name, law=thing(Coulomb))
    yield entry_point(sf.GMS, elements=[*thing(), (), (3,), (sf.Element,)])
    yield entry_point(sf.MaxwellSlip, elements=[*thing(), (), (3,), (sf.Slider,)])
    yield entry_point(
        sf.Table,
        {"speeds": (0.0, 1.0), "coefficients": (0.2, 0.1)},
        speeds=[*thing(), (0.0,), (1.0, 0.0), (0.0, NAN), ("a", "b"), (-1.0, 1.0)],
        coefficients=[*thing(), (0.0,), (1.0, -1.0), (0.0, INF), ("a", "b")],
    )
    for kind in (sf.GenericAsperity, sf.RandomBristles):
        bad = {"count": count(), "seed": [*number(-1), 1.5]}
        yield entry_point(kind, **bad)
    rows = [None, 3.0, "ab", [], [0.0], [0.0, NAN], [[0.0, 1.0]], {}, Thing(), [1j, 2], ["a", "b"]]
    yield entry_point(
        sf.RandomBristles().force,
        {"t": [0.0, 1.0], "x": [0.0, 1.0], "N": 1.0},
        t=[*rows, [1.0, 0.0], [0.0, 0.0]],
        x=rows,
        N=number(-1.0),
    )
    texts = ["lugre+", "nonsense", "lugre)", "lagged()", "lagged", "x" * 10000]
    texts.append("lagged(" * 600 + "lugre" + ")" * 600)
    yield entry_point(sf.law_from_text, text=[None, 3, [], Thing(), "", "+", Coulomb, *texts])
    for query in (sf.law_name, sf.parameters):
        yield entry_point(lambda x, query=query: query(x), {}, query.__name__, x=thing(Coulomb))
    yield entry_point(
        sf.with_values,
        {"obj": LuGre(), "values": {}},
        obj=thing(LuGre),
        values=[*values("mu_s")[:8], *({"mu_s": x} for x in parameter(-1.0))],
    )
    yield entry_point(lambda name: sf.symbolise(LuGre(), name), "symbolise", name=choice())
    yield entry_point(lambda x: sf.symbolise(x, "mu_s"), "symbolise", x=thing(LuGre))


def entry_points_of_scenes() -> Iterator[EntryPoint]:
    for name, kind in ALL_SCENES.items():
        bad: dict[str, list[Any]] = {"law": thing(BrownMcPhee, "lugre", belt())}
        for item in fields(kind):
            if "unit" in item.metadata:
                low = item.metadata["lower"]
                every = parameter if kind is Rabinowicz else some_parameter
                bad[item.name] = every(*([low - 1.0] if low > -INF else []))
        yield entry_point(kind, {"law": BrownMcPhee()}, name, **bad)
    for make in (sf.rabinowicz, sf.drive):
        yield entry_point(
            make,
            {"law": BrownMcPhee()},
            law=thing(BrownMcPhee, "lugre"),
            free=names("mu_d"),
            mu_d=parameter(-1.0),
            nonsense=[1.0],
        )
    yield entry_point(Rabinowicz(BrownMcPhee()).model, free=names("mu_d"))


def entry_points_of_figures() -> Iterator[EntryPoint]:
    yield entry_point(
        compare,
        {"laws": [Coulomb()]},
        laws=[*thing("lugre", Coulomb()), [3], [None], ["nonsense"], {"a": 3}, [Coulomb]],
        scenario=choice(),
        N=number(0.0, -1.0),
    )
    yield entry_point(
        figure,
        {"law": Coulomb(), "name": "profile"},
        law=thing(Coulomb),
        name=choice(),
        N=number(0.0, -1.0),
    )
    for name, make in FIGURES.items():
        yield entry_point(make, {"law": LuGre()}, name, law=thing(LuGre), N=number(0.0, -1.0))
    data = compare([Coulomb()])
    yield entry_point(lambda name: data[name], "FigureData[]", name=choice())
    yield entry_point(data.plot, path=[*path(), "a.xyz", "."])


test_every_entry_point_refuses_bad_input_in_a_sentence = entry_points_refuse(
    {
        "simulation": entry_points_of_simulation,
        "trajectory": entry_points_of_a_trajectory,
        "models": entry_points_of_models,
        "laws": entry_points_of_laws,
        "scenes": entry_points_of_scenes,
        "figures": entry_points_of_figures,
    }
)
