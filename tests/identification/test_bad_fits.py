"""Bad Python input at data, kinds of residuals and fits."""

from collections.abc import Iterator
from typing import Any

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
    number,
    thing,
    values,
)

from identification import (
    ClosedLoop,
    Dataset,
    Filter,
    Fit,
    InverseDynamics,
    Points,
    Record,
    Shooting,
    above,
    binned,
    linear,
    log,
    six_steps,
    synthetic_drive_data,
    tied,
)
from symfric.laws import Coulomb


def doors_of_fits() -> Iterator[Door]:
    v = np.linspace(-0.1, 0.1, 60)
    data = Dataset.of(v=v, F=np.sign(v) + v, points=True)
    kind = Points()

    def fitted(**given: Any) -> Any:
        return Fit(**given).prepared()

    yield Door(
        "Fit",
        fitted,
        {"kind": kind, "what": "coulomb+viscous", "data": data},
        {
            "kind": [*thing(Points), "inverse"],
            "what": [*thing(Coulomb), "", "nonsense", "coulomb+"],
            "data": thing(Dataset, np.zeros((100, 3)), "run.csv"),
            "free": [
                3,
                "mu_d",
                ["nonsense"],
                [3],
                Thing(),
                {"mu_d": "log"},
                {"mu_d": (2.0, 1.0)},
                {"mu_d": (1.0, 2.0, 3.0)},
                {"mu_d": NAN},
                {"mu_d": above("nonsense")},
                {"mu_d": above("mu_d")},
                {"mu_d": tied("mu_d")},
                {"mu_d": tied("nonsense")},
                {"x0": "estimate"},
                {3: log(1.0, 2.0)},
            ],
            "fixed": [*values("mu_d")[1:], {"mu_d": -1.0}],
            "normal_force": number(0.0, -1.0),
            "noise": [3, "nonsense", {"nonsense": 1.0}, *({"F": x} for x in number(0.0))],
            "loss": choice(),
            "starts": count(),
            "start": [*choice()[1:], {"nonsense": 1.0}, *({"mu_d": x} for x in number())],
            "seed": [*number(), -1, 1.5],
            "evaluations": count(1),
        },
    )
    ready = Fit(kind, "viscous", data)
    yield Door("Fit.solve", ready.solve, {}, {"throw": flag(), "progress": function()})
    yield Door(
        "log", log, {"lower": 1.0, "upper": 2.0}, {"lower": number(0.0, 3.0), "upper": number(0.5)}
    )
    yield Door("linear", linear, {"lower": 1.0, "upper": 2.0}, {"lower": [NAN, "a", 3.0, Thing()]})
    yield Door("above", above, {"name": "mu_d"}, {"name": [None, 3, Thing()]})
    yield Door("tied", tied, {"to": "mu_d"}, {"to": [None, 3, Thing()], "factor": number()})


def doors_of_kinds() -> Iterator[Door]:
    name = [None, 3, "", [], Thing(), True]
    seconds = [NAN, INF, -1.0, 0.0, [1.0], Thing(), True]
    yield Door(
        "InverseDynamics",
        InverseDynamics,
        {},
        {
            "force": name,
            "x": name,
            "v": name[1:],
            "filter": thing(Filter)[1:],
            "dead_time": [3, "a", (1.0,), (2.0, 1.0), (0.0, NAN), Thing(), (None, 1.0)],
        },
    )
    yield Door(
        "Points",
        Points,
        {},
        {
            "v": name,
            "F": name,
            "N": [-1.0, NAN, [], Thing(), True],
            "weight": name[1:],
            "states": choice(),
            "offset": flag(),
        },
    )
    yield Door(
        "Shooting",
        Shooting,
        {},
        {
            "signals": [3, [3], Thing(), True, {3: "x"}, {"x": 3}],
            "windows": [*seconds, "nonsense", ""],
            "x0": [None, 3, "nonsense", [], Thing()],
            "inputs": [3, "force", [], Thing(), {3: "force"}],
            "interpolation": choice(),
            "dead_time": [None, "a", -1.0, NAN, (2.0, 1.0), (1.0,), Thing()],
            "every": count(),
            "rtol": number(0.0, -1.0, 1.0, optional=True),
        },
    )
    yield Door("ClosedLoop", ClosedLoop, {}, {"loop": thing(ClosedLoop)[1:]})


def doors_of_identification() -> Iterator[Door]:
    data = synthetic_drive_data(speeds=(0.01, 0.05))
    one = data[0]
    columns: dict[str, Any] = {"t": one.t, "x": one["x"], "force": one["force"]}
    bad = [None, 3.0, "abc", [], {}, Thing(), [[1.0]], one["x"][:-1], one["x"] * NAN, 1j]
    yield Door(
        "Dataset.of",
        Dataset.of,
        columns,
        {
            "t": [*bad[1:], one.time[::-1], one.time * 0],
            "x": bad,
            "force": bad,
            "units": [3, "nonsense", ["m"], {"x": 3}, {"x": "parsec"}, {"nonsense": "m"}, Thing()],
            "step": number(0.0, -1.0, optional=True),
            "name": [None, 3, Thing()],
        },
    )
    yield Door(
        "Record",
        Record,
        {"name": "r", "t": one.t, "signals": {"x": one["x"]}, "units": {"x": "m"}},
        {
            "signals": [None, 3, {}, {"x": None}, {"x": "a"}, {3: one["x"]}, Thing()],
            "units": [3, "m", {"x": 3}, {"nonsense": "m"}, Thing()],
        },
    )
    yield Door("Dataset", Dataset, {"records": (one,)}, {"records": [3, "a", (), (3,), Thing()]})
    yield Door(
        "Filter",
        Filter,
        {"cutoff": 10.0},
        {
            "cutoff": number(0.0, -1.0),
            "decimation": count(),
            "order": count(),
            "v_min": number(-1.0, optional=True),
        },
    )
    yield Door("Dataset.resampled", data.resampled, {}, {"step": number(0.0, -1.0, optional=True)})
    yield Door("Dataset.split", data.split, {}, {"share": number(0.0, -1.0, 1.0)})
    yield Door("Dataset.thinned", data.thinned, {}, {"every": count()})
    yield Door("Dataset.renamed", data.renamed, {}, {"names": [3, {"nonsense": "y"}, {"x": 3}]})
    yield Door("Dataset.delayed", data.delayed, {}, {"delays": values("x")})
    yield Door(
        "Dataset.between",
        data.between,
        {"begin": 1.0, "end": 2.0},
        {"begin": number(3.0), "end": number(0.5)},
    )
    yield Door(
        "Dataset.read",
        Dataset.read,
        {"paths": "a.csv"},
        {
            "paths": [None, 3, "", b"x", Thing(), [], "nothing.csv", ".", "a\0b", "*.csv"],
            "columns": [3, "x", {"nonsense": "x"}, {"x": 3}, Thing()],
        },
    )
    points = {"v": np.geomspace(1e-3, 1.0, 60), "F": np.ones(60)}
    yield Door("binned", binned, points, {"v": bad, "F": bad})
    yield Door("six_steps", six_steps, points, {"v": bad, "F": bad, "unstable": number(-1.0)})


test_every_door_refuses_bad_input_in_a_sentence = every_door_refuses(
    {"fits": doors_of_fits, "kinds": doors_of_kinds, "data": doors_of_identification}
)
