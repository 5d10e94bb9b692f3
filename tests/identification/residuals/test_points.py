import pickle

import numpy as np
import pytest
from fits import check_slopes, evaluated

from identification.data.dataset import Dataset
from identification.residuals.points import Points
from identification.unknowns.subject import subject
from symfric import Asymmetric, Stribeck, law_from_text
from symfric.foundation.parameters import parameters
from symfric.laws import Law
from symfric.laws.composed.populations import steady_force

V = np.array([-0.2, -0.03, -0.004, 0.002, 0.02, 0.1])


def points(F: np.ndarray, v: np.ndarray = V) -> Dataset:
    return Dataset.of(v=v, F=F, points=True, units={"v": "m/s", "F": "N"})


def start(law: Law, names: tuple[str, ...]) -> np.ndarray:
    known = parameters(law)
    return np.array([float(known[n].value) for n in names])


@pytest.mark.parametrize("text", ["stribeck", "asymmetric(coulomb+viscous)", "lugre", "dahl"])
def test_points_lie_on_the_steady_curve(text: str) -> None:
    law = law_from_text(text)
    one = subject(law, points=True)
    assert one.law is not None
    rows = Points().prepare(one, points(steady_force(one.law, V, 1.0)))
    values = start(one.law, one.names)
    np.testing.assert_allclose(evaluated(rows, values).r, 0.0, atol=1e-12)
    check_slopes(rows, values * 1.1)


def test_the_normal_force_is_a_channel_a_number_or_that_of_the_fit() -> None:
    law, N = Stribeck(mu_s=0.3, mu_d=0.2, v_s=0.01), np.linspace(1.0, 6.0, V.size)
    one = subject(law, points=True, normal_force=4.0)
    assert one.law is not None
    values = start(one.law, one.names)
    for channel, load in ((None, 4.0), (2.5, 2.5)):
        F = steady_force(one.law, V, load)
        r = evaluated(Points(N=channel).prepare(one, points(F)), values).r
        np.testing.assert_allclose(r, 0.0, atol=1e-12)
    forces = np.array([one.law.force(v, n) for v, n in zip(V, N, strict=True)])
    units = {"v": "m/s", "F": "N", "N": "N"}
    data = Dataset.of(v=V, F=forces, points=True, N=N, units=units)
    np.testing.assert_allclose(evaluated(Points().prepare(one, data), values).r, 0.0, atol=1e-12)


def test_points_at_rest_are_break_away_forces() -> None:
    law = Stribeck(mu_s=3.0, mu_d=2.0, v_s=0.01)
    one = subject(law, points=True)
    F = np.array([3.3, -2.8, float(law.force(0.05, 1.0))])
    rows = Points().prepare(one, points(F, np.array([0.0, 0.0, 0.05])))
    assert one.law is not None
    values = start(one.law, one.names)
    np.testing.assert_allclose(evaluated(rows, values).r, [-0.3, -0.2, 0.0], atol=1e-12)
    check_slopes(rows, values)


def test_weights_multiply_rows() -> None:
    one = subject(Stribeck(), points=True)
    assert one.law is not None
    values, F = start(one.law, one.names), np.zeros(V.size)
    plain = evaluated(Points().prepare(one, points(F)), values)
    n = np.array([1.0, 4.0, 1.0, 4.0, 1.0, 1.0])
    data = Dataset.of(v=V, F=F, points=True, n=n, units={"v": "m/s", "F": "N"})
    weighted = evaluated(Points(weight="n").prepare(one, data), values)
    np.testing.assert_allclose(weighted.r, plain.r * np.sqrt(n / n.mean()))
    np.testing.assert_allclose(weighted.J, plain.J * np.sqrt(n / n.mean())[:, None])


def test_channels_and_pickle() -> None:
    one = subject(Stribeck(), points=True)
    assert one.law is not None
    both = points(np.zeros(V.size)) + points(np.ones(V.size))
    rows = Points().prepare(one, both)
    assert [(c.record, c.signal, c.unit, c.ordered) for c in rows.channels] == [
        (0, "F", "N", False),
        (1, "F", "N", False),
    ]
    assert rows.channels[1].rows == slice(V.size, 2 * V.size)
    values = start(one.law, one.names)
    again = pickle.loads(pickle.dumps(rows))
    np.testing.assert_array_equal(evaluated(again, values).r, evaluated(rows, values).r)


def test_offset_is_an_unknown_of_its_own() -> None:
    law = Stribeck()
    F = steady_force(law, V, 1.0) - 0.3
    found = subject(law, points=True)
    rows = Points(offset=True).prepare(found, points(F))
    assert rows.names == (*found.names, "offset")
    values = np.append(start(law, found.names), -0.3)
    assert np.allclose(evaluated(rows, values).r, 0.0, atol=1e-12)
    check_slopes(rows, values)


def test_break_away_of_each_direction_has_its_own_level() -> None:
    law = Asymmetric(Stribeck(mu_s=3.0, mu_d=2.0), Stribeck(mu_s=5.0, mu_d=4.0))
    one = subject(law, points=True)
    rows = Points().prepare(one, points(np.array([1.0, -1.0]), np.zeros(2)))
    r = evaluated(rows, start(law, one.names)).r
    np.testing.assert_allclose(r, [3.0 - 1.0, -5.0 + 1.0], atol=1e-12)
