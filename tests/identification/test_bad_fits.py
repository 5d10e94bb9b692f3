"""Bad Python input at data, kinds of residuals and fits."""

from collections.abc import Iterator
from typing import Any

import bad_values as bad
import numpy as np
from bad_values import INF, NAN, EntryPoint, Thing

import identification as own
from symfric.laws import Coulomb


def entry_points_of_fits() -> Iterator[EntryPoint]:
    v = np.linspace(-0.1, 0.1, 60)
    data = own.Dataset.of(v=v, F=np.sign(v) + v, points=True)
    right = {"kind": own.Points(), "what": "coulomb+viscous", "data": data}
    specs = ["log", (2.0, 1.0), (1.0, 2.0, 3.0), NAN]
    specs += [
        own.above("nonsense"),
        own.above("mu_d"),
        own.tied("mu_d"),
        own.tied("nonsense"),
    ]
    names: list[Any] = [3, "mu_d", ["nonsense"], [3], Thing(), {"x0": "estimate"}]

    def fitted(**given: Any) -> Any:
        return own.Fit(**given).prepared()

    wrong = {
        "kind": [*bad.thing(own.Points), "inverse"],
        "what": [*bad.thing(Coulomb), "", "nonsense", "coulomb+"],
        "data": bad.thing(own.Dataset, np.zeros((100, 3)), "run.csv"),
        "free": [*names, *({"mu_d": spec} for spec in specs), {3: own.log(1.0, 2.0)}],
        "fixed": [*bad.values("mu_d")[1:], {"mu_d": -1.0}],
        "normal_force": bad.number(0.0, -1.0),
        "noise": [3, "nonsense", {"nonsense": 1.0}, *({"F": x} for x in bad.number(0.0))],
        "loss": bad.choice(), "starts": bad.count(), "seed": [*bad.number(), -1, 1.5],
        "evaluations": bad.count(1),
        "start": [*bad.choice()[1:], {"nonsense": 1.0}, *({"mu_d": x} for x in bad.number())],
    }  # fmt: skip
    yield EntryPoint("Fit", fitted, right, wrong)
    solve = own.Fit(own.Points(), "viscous", data).solve
    yield EntryPoint("Fit.solve", solve, {}, {"throw": bad.flag(), "progress": bad.function()})
    one: list[Any] = [None, 3, Thing()]
    box = {"lower": 1.0, "upper": 2.0}
    yield EntryPoint("log", own.log, box, {"lower": bad.number(0.0, 3.0), "upper": bad.number(0.5)})
    yield EntryPoint("linear", own.linear, box, {"lower": [NAN, "a", 3.0, Thing()]})
    yield EntryPoint("above", own.above, {"name": "mu_d"}, {"name": one})
    yield EntryPoint("tied", own.tied, {"to": "mu_d"}, {"to": one, "factor": bad.number()})


def entry_points_of_kinds() -> Iterator[EntryPoint]:
    name = [None, 3, "", [], Thing(), True]
    seconds = [NAN, INF, -1.0, 0.0, [1.0], Thing(), True]
    inverse = {
        "force": name, "x": name, "v": name[1:], "filter": bad.thing(own.Filter)[1:],
        "dead_time": [3, "a", (1.0,), (2.0, 1.0), (0.0, NAN), Thing(), (None, 1.0)],
    }  # fmt: skip
    points = {
        "v": name, "F": name, "N": [-1.0, NAN, [], Thing(), True], "weight": name[1:],
        "states": bad.choice(), "offset": bad.flag(),
    }  # fmt: skip
    shooting = {
        "signals": [3, [3], Thing(), True, {3: "x"}, {"x": 3}],
        "windows": [*seconds, "nonsense", ""],
        "x0": [None, 3, "nonsense", [], Thing()],
        "inputs": [3, "force", [], Thing(), {3: "force"}],
        "interpolation": bad.choice(), "every": bad.count(),
        "rtol": bad.number(0.0, -1.0, 1.0, optional=True),
        "dead_time": [None, "a", -1.0, NAN, (2.0, 1.0), (1.0,), Thing()],
    }  # fmt: skip
    yield EntryPoint("InverseDynamics", own.InverseDynamics, {}, inverse)
    yield EntryPoint("Points", own.Points, {}, points)
    yield EntryPoint("Shooting", own.Shooting, {}, shooting)
    yield EntryPoint(
        "ClosedLoop",
        own.ClosedLoop,
        {},
        {"loop": bad.thing(own.ClosedLoop)[1:]},
    )


def entry_points_of_identification() -> Iterator[EntryPoint]:
    data = own.synthetic_drive_data(speeds=(0.01,), dwell=0.1)
    one = data[0]
    x, step = one["x"], bad.number(0.0, -1.0, optional=True)
    odd = [None, 3.0, "abc", [], {}, Thing(), [[1.0]], x[:-1], x * NAN, 1j]
    columns = {
        "t": [*odd[1:], one.time[::-1], one.time * 0], "x": odd, "force": odd, "step": step,
        "units": [3, "nonsense", ["m"], {"x": 3}, {"x": "parsec"}, {"nonsense": "m"}, Thing()],
        "name": [None, 3, Thing()],
    }  # fmt: skip
    record = {
        "signals": [None, 3, {}, {"x": None}, {"x": "a"}, {3: x}, Thing()],
        "units": [3, "m", {"x": 3}, {"nonsense": "m"}, Thing()],
    }
    filters = {
        "cutoff": bad.number(0.0, -1.0), "decimation": bad.count(), "order": bad.count(),
        "v_min": bad.number(-1.0, optional=True),
    }  # fmt: skip
    read = {
        "paths": [None, 3, "", b"x", Thing(), [], "nothing.csv", ".", "a\0b", "*.csv"],
        "columns": [3, "x", {"nonsense": "x"}, {"x": 3}, Thing()],
    }
    right = {"name": "r", "t": one.t, "signals": {"x": x}, "units": {"x": "m"}}
    points = {"v": np.geomspace(1e-3, 1.0, 60), "F": np.ones(60)}
    yield EntryPoint(
        "Dataset.of",
        own.Dataset.of,
        {"t": one.t, "x": x, "force": one["force"]},
        columns,
    )
    yield EntryPoint("Record", own.Record, right, record)
    yield EntryPoint(
        "Dataset",
        own.Dataset,
        {"records": (one,)},
        {"records": [3, "a", (), (3,), Thing()]},
    )
    yield EntryPoint("Filter", own.Filter, {"cutoff": 10.0}, filters)
    yield EntryPoint("Dataset.resampled", data.resampled, {}, {"step": step})
    yield EntryPoint("Dataset.split", data.split, {}, {"share": bad.number(0.0, -1.0, 1.0)})
    yield EntryPoint("Dataset.thinned", data.thinned, {}, {"every": bad.count()})
    yield EntryPoint(
        "Dataset.renamed", data.renamed, {}, {"names": [3, {"nonsense": "y"}, {"x": 3}]}
    )
    yield EntryPoint("Dataset.delayed", data.delayed, {}, {"delays": bad.values("x")})
    ends = {"begin": bad.number(0.3), "end": bad.number(0.05)}
    yield EntryPoint("Dataset.between", data.between, {"begin": 0.1, "end": 0.2}, ends)
    yield EntryPoint("Dataset.read", own.Dataset.read, {"paths": "a.csv"}, read)
    yield EntryPoint("binned", own.binned, points, {"v": odd, "F": odd})
    yield EntryPoint(
        "six_steps",
        own.six_steps,
        points,
        {"v": odd, "F": odd, "unstable": bad.number(-1.0)},
    )


test_every_entry_point_refuses_bad_input_in_a_sentence = bad.entry_points_refuse(
    {
        "fits": entry_points_of_fits,
        "kinds": entry_points_of_kinds,
        "data": entry_points_of_identification,
    }
)
