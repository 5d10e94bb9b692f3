"""Bad Python input at data, kinds of residuals and fits: `entry_points.toml` lists it."""

from collections.abc import Iterator
from typing import Any

import bad_values as bad
import numpy as np
from bad_values import NAN, EntryPoint, Thing
from tables import table

import identification as own
from symfric.laws import Coulomb

TABLE = table(__file__, "entry_points")


def entry_points_of_fits() -> Iterator[EntryPoint]:
    v = np.linspace(-0.1, 0.1, 60)
    data = own.Dataset.of(v=v, F=np.sign(v) + v, points=True)
    specs = ["log", (2.0, 1.0), (1.0, 2.0, 3.0), NAN, own.above("nonsense"), own.above("mu_d")]
    specs += [own.tied("mu_d"), own.tied("nonsense")]

    def fitted(**given: Any) -> Any:
        return own.Fit(**given).prepared()

    return bad.listed(
        TABLE["fits"],
        {
            "own": own, "Coulomb": Coulomb, "fitted": fitted, "data": data, "specs": specs,
            "solve": own.Fit(own.Points(), "viscous", data).solve, "one": [None, 3, Thing()],
            "right": {"kind": own.Points(), "what": "coulomb+viscous", "data": data},
            "names": [3, "mu_d", ["nonsense"], [3], Thing(), {"x0": "estimate"}],
            "box": {"lower": 1.0, "upper": 2.0},
        },
    )  # fmt: skip


def entry_points_of_kinds() -> Iterator[EntryPoint]:
    name = [None, 3, "", [], Thing(), True]
    return bad.listed(TABLE["kinds"], {"own": own, "name": name})


def entry_points_of_identification() -> Iterator[EntryPoint]:
    data = own.synthetic_drive_data(speeds=(0.01,), dwell=0.1)
    one = data[0]
    x = one["x"]
    names = {
        "own": own, "data": data, "one": one, "x": x, "step": bad.number(0.0, -1.0, optional=True),
        "odd": [None, 3.0, "abc", [], {}, Thing(), [[1.0]], x[:-1], x * NAN, 1j],
        "right": {"name": "r", "t": one.t, "signals": {"x": x}, "units": {"x": "m"}},
        "points": {"v": np.geomspace(1e-3, 1.0, 60), "F": np.ones(60)},
    }  # fmt: skip
    return bad.listed(TABLE["data"], names)


test_every_entry_point_refuses_bad_input_in_a_sentence = bad.entry_points_refuse(
    {
        "fits": entry_points_of_fits,
        "kinds": entry_points_of_kinds,
        "data": entry_points_of_identification,
    }
)
