"""Laws through JSON and back: the same numbers, options and elements."""

import json
from dataclasses import dataclass, replace
from typing import ClassVar, final

import casadi as ca
import numpy as np
import pytest

from identification.result.stored import from_data, to_data
from symfric import ALL_LAWS, GMS, Asymmetric, Coulomb, Element, Law, Stribeck, Sum, Table, Viscous
from symfric.foundation.numeric import Scalar
from symfric.foundation.parameters import param, parameters, with_values
from symfric.laws import StaticLaw
from symfric.laws.base.law import Facts
from symfric.laws.catalogue import law_from_text
from symfric.scenes import Drive

LAWS: list[Law] = [
    *(kind() for kind in ALL_LAWS.values()),
    GMS(elements=tuple(Element(1e4 * k, 0.1 * k) for k in range(1, 11)), form="event"),
    Asymmetric(Stribeck(mu_s=0.3), Stribeck(mu_s=0.2)),
    Sum((Coulomb(mu_d=0.123456789012345), Viscous(sigma_2=1e-17))),
    law_from_text("lagged(stribeck)"),
    law_from_text("load_dependent(lugre)"),
    law_from_text("temperature_dependent(coulomb+viscous)"),
    Table(speeds=(0.0, 0.1, 0.3), coefficients=(0.3, 0.2, 0.25)),
]


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
def test_every_law_comes_back_bit_for_bit(law: Law) -> None:
    back = from_data(json.loads(json.dumps(to_data(law))))
    assert type(back) is type(law)
    assert {n: p.value for n, p in parameters(back).items()} == {
        n: p.value for n, p in parameters(law).items()
    }
    assert json.dumps(to_data(back)) == json.dumps(to_data(law))


def test_a_drive_comes_back_with_its_law() -> None:
    drive = Drive(GMS(elements=(Element(3e4, 0.5),) * 3), m=3.0, N=1.0, offset=-2.0, turning=True)
    back = from_data(to_data(drive))
    assert isinstance(back, Drive)
    assert (back.m, back.offset, back.turning) == (3.0, -2.0, True)
    assert len(back.law.states) == 6
    v = np.linspace(-0.1, 0.1, 7)
    assert isinstance(back.law, GMS)
    assert np.array_equal(
        [back.law.level(x, 1.0) for x in v],
        [drive.law.level(x, 1.0) for x in v],  # pyright: ignore
    )


@final
@dataclass(frozen=True, eq=False)
class Mine(StaticLaw):
    """A law of the user's own."""

    facts: ClassVar[Facts] = Coulomb.facts
    mu: Scalar = param(0.3, unit="1", doc="coefficient")

    @property
    def velocity_scale(self) -> Scalar:
        return 1.0

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        return self.mu * N * v


def test_a_law_of_ones_own_comes_back_where_its_class_is_given() -> None:
    data = to_data(Sum((Mine(mu=0.25), Viscous())))
    with pytest.raises(ValueError, match="Mine"):
        from_data(data)
    back = from_data(data, {"Mine": Mine})
    assert parameters(back)["mu"].value == 0.25


def test_what_is_not_known_is_refused_by_name() -> None:
    with pytest.raises(ValueError, match="stribeck"):
        from_data({"kind": "stribek"})
    with pytest.raises(ValueError, match="mu_s"):
        from_data({"kind": "stribeck", "mu_z": 0.1})
    with pytest.raises(ValueError, match="expected a number, got the expression mu"):
        to_data(with_values(Stribeck(), {"mu_s": ca.SX.sym("mu")}))


def test_a_changed_number_is_checked_by_the_law() -> None:
    data = to_data(replace(Stribeck(), mu_s=0.4)) | {"mu_d": 0.5}
    with pytest.raises(ValueError, match="mu_d <= mu_s"):
        from_data(data)
