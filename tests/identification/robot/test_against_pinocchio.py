"""An arm with seven joints whose torques are computed by Pinocchio."""

from typing import Any

import numpy as np
import pytest

from identification import Dataset, identify_robot
from symfric.bench.identification import COULOMB, VISCOUS, arm

pin: Any = pytest.importorskip("pinocchio", reason="needs Pinocchio (extra pinocchio)")


def motion(seed, t):
    rng, w = np.random.default_rng(seed), 2 * np.pi * np.array([0.13, 0.29, 0.47])
    phase = rng.uniform(0, 6, (3, 1, 7))
    s = w[:, None, None] * t[:, None] + phase
    size = (np.array([0.6, 0.5, 0.3])[:, None, None], w[:, None, None])
    q = np.sum(size[0] * np.sin(s), axis=0)
    v = np.sum(size[0] * size[1] * np.cos(s), axis=0)
    return q, v, -np.sum(size[0] * size[1] ** 2 * np.sin(s), axis=0)


def test_friction_and_torques_of_pinocchio_are_found():
    model = pin.buildModelFromXML(arm())
    data, t = model.createData(), np.arange(3000) / 200.0

    def rigid(q, v, a):
        rows = zip(q, v, a, strict=True)
        return np.array([pin.rnea(model, data, *row) for row in rows])

    q, v, a = motion(1, t)
    tau = rigid(q, v, a) + COULOMB * np.sign(v) + VISCOUS * v
    tau += 0.05 * np.random.default_rng(0).standard_normal(q.shape)
    columns = {f"j{k + 1}": 1e-5 * np.rint(q[:, k] / 1e-5) for k in range(7)}
    columns |= {f"j{k + 1}_torque": tau[:, k] for k in range(7)}
    units = {name: "N m" if "torque" in name else "rad" for name in columns}
    wrong = arm().replace('mass value="1.2"', 'mass value="2.0"')  # the fifth link of the file
    fit = identify_robot(wrong, Dataset.of({"t": t, **columns}, units=units))
    for k, joint in enumerate(fit.joints):
        for name, truth in (("mu_d", COULOMB[k]), ("sigma_2", VISCOUS[k])):
            found = fit.friction[joint][name]
            assert abs(found.value - truth) < 1.5 * (found.high - found.low), (joint, name)
    q, v, a = (y[::20] for y in motion(2, t))
    truth = rigid(q, v, a) + COULOMB * np.sign(v) + VISCOUS * v
    fast = np.abs(v) > 0.02
    assert np.sqrt(np.mean((fit.torques(q, v, a) - truth)[fast] ** 2)) < 0.05
