import pickle

import numpy as np
import pytest
from fits import check_slopes, evaluated

from identification.data.dataset import Dataset
from identification.residuals.points import Array, PointRows, Points
from identification.unknowns.subject import subject
from symfric import Asymmetric, Stribeck, law_from_text
from symfric.foundation.parameters import parameters
from symfric.laws import Law
from symfric.laws.composed.populations import steady_force

V = np.array([-0.2, -0.03, -0.004, 0.002, 0.02, 0.1])


def points(F: np.ndarray, v: np.ndarray = V) -> Dataset:
    return Dataset.of(v=v, F=F, points=True, units={"v": "m/s", "F": "N"})


def prepared(law: Law, data: Dataset, load: float = 1.0, **how: object) -> tuple[PointRows, Array]:
    """The residuals of points, and the values of the law."""
    one = subject(law, points=True, normal_force=load)
    known = parameters(one.law)
    rows = Points(**how).prepare(one, data)  # pyright: ignore[reportArgumentType]
    return rows, np.array([float(known[n].value) for n in one.names])


@pytest.mark.parametrize("text", ["stribeck", "asymmetric(coulomb+viscous)", "lugre", "dahl"])
def test_points_lie_on_the_steady_curve(text: str) -> None:
    law = subject(law_from_text(text), points=True).law
    rows, values = prepared(law, points(steady_force(law, V, 1.0)))
    np.testing.assert_allclose(evaluated(rows, values).r, 0.0, atol=1e-12)
    check_slopes(rows, values * 1.1)


def test_the_normal_force_is_a_channel_a_number_or_that_of_the_fit() -> None:
    law, N = Stribeck(mu_s=0.3, mu_d=0.2, v_s=0.01), np.linspace(1.0, 6.0, V.size)
    law = subject(law, points=True, normal_force=4.0).law
    forces = np.array([law.force(v, n) for v, n in zip(V, N, strict=True)])
    units = {"v": "m/s", "F": "N", "N": "N"}
    loaded = Dataset.of(v=V, F=forces, points=True, N=N, units=units)
    cases = [(points(steady_force(law, V, x)), N) for N, x in ((None, 4.0), (2.5, 2.5))]
    for data, channel in [*cases, (loaded, None)]:
        found = evaluated(*prepared(law, data, 4.0, N=channel))
        np.testing.assert_allclose(found.r, 0.0, atol=1e-12)


def test_points_at_rest_are_break_away_forces() -> None:
    law = Stribeck(mu_s=3.0, mu_d=2.0, v_s=0.01)
    F = np.array([3.3, -2.8, float(law.force(0.05, 1.0))])
    rows, values = prepared(law, points(F, np.array([0.0, 0.0, 0.05])))
    np.testing.assert_allclose(evaluated(rows, values).r, [-0.3, -0.2, 0.0], atol=1e-12)
    check_slopes(rows, values)


def test_weights_multiply_rows() -> None:
    F = np.zeros(V.size)
    plain = evaluated(*prepared(Stribeck(), points(F)))
    n = np.array([1.0, 4.0, 1.0, 4.0, 1.0, 1.0])
    data = Dataset.of(v=V, F=F, points=True, n=n, units={"v": "m/s", "F": "N"})
    weighted = evaluated(*prepared(Stribeck(), data, weight="n"))
    np.testing.assert_allclose(weighted.r, plain.r * np.sqrt(n / n.mean()))
    np.testing.assert_allclose(weighted.J, plain.J * np.sqrt(n / n.mean())[:, None])


def test_channels_and_pickle() -> None:
    rows, values = prepared(Stribeck(), points(np.zeros(V.size)) + points(np.ones(V.size)))
    found = [(c.record, c.signal, c.unit, c.ordered) for c in rows.channels]
    assert found == [(k, "F", "N", False) for k in range(2)]
    assert rows.channels[1].rows == slice(V.size, 2 * V.size)
    again = pickle.loads(pickle.dumps(rows))
    np.testing.assert_array_equal(evaluated(again, values).r, evaluated(rows, values).r)


def test_offset_is_an_unknown_of_its_own() -> None:
    rows, values = prepared(Stribeck(), points(steady_force(Stribeck(), V, 1.0) - 0.3), offset=True)
    assert rows.names[-1] == "offset"
    values = np.append(values, -0.3)
    assert np.allclose(evaluated(rows, values).r, 0.0, atol=1e-12)
    check_slopes(rows, values)


def test_break_away_of_each_direction_has_its_own_level() -> None:
    law = Asymmetric(Stribeck(mu_s=3.0, mu_d=2.0), Stribeck(mu_s=5.0, mu_d=4.0))
    found = evaluated(*prepared(law, points(np.array([1.0, -1.0]), np.zeros(2))))
    np.testing.assert_allclose(found.r, [3.0 - 1.0, -5.0 + 1.0], atol=1e-12)
