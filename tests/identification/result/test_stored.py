"""A fit as JSON and back; its parts, laws and calls as plain data and Python."""

import json
from dataclasses import dataclass, field, replace
from math import inf, isnan, nan
from pathlib import Path
from typing import Any, ClassVar, final

import casadi as ca
import numpy as np
import pytest
from fits import make
from numpy.typing import NDArray

from identification.data.dataset import Dataset
from identification.fit import Fit
from identification.residuals.inverse import InverseDynamics
from identification.residuals.shooting import Shooting
from identification.result.build import written
from identification.result.fitted import Fitted
from identification.result.stored import from_data, plain, revived
from identification.unknowns.spec import above, linear, log, tied
from symfric import (
    ALL_LAWS,
    GMS,
    Asymmetric,
    Coulomb,
    Element,
    Law,
    Linear,
    LuGre,
    Stribeck,
    Sum,
    Table,
    Viscous,
    rabinowicz,
)
from symfric.foundation.numeric import Scalar
from symfric.foundation.parameters import param, parameters, with_values
from symfric.foundation.status import Status
from symfric.laws import StaticLaw
from symfric.laws.base.law import Facts
from symfric.laws.catalogue import law_from_text
from symfric.scenes import Drive, Rabinowicz


@pytest.fixture(scope="module")
def fit() -> Fitted:
    return make(records=2, starts=2, call="Fit(...)")


@pytest.fixture
def file(fit: Fitted, tmp_path: Path) -> Path:
    fit.to_json(tmp_path / "fit.json")
    return tmp_path / "fit.json"


def test_everything_comes_back(fit: Fitted, file: Path) -> None:
    back = Fitted.from_json(file)
    assert json.dumps(back.to_dict()) == json.dumps(fit.to_dict())
    assert str(back) == str(fit)
    assert back.values == fit.values
    assert back.status is fit.status
    assert repr(back.law) == repr(fit.law)
    v = np.linspace(-0.1, 0.1, 101)
    assert back.law is not None
    assert fit.law is not None
    assert np.array_equal(back.law.force(v, 1.0), fit.law.force(v, 1.0))
    assert back.made["call"] == "Fit(...)"


def test_the_file_is_plain_json_with_names_that_a_program_finds(file: Path) -> None:
    data = json.loads(file.read_text())
    assert (data["file"], data["format"], data["law"]) == ("symfric fit", 1, "stribeck")
    assert data["parameters"]["mu_s"].keys() >= {"value", "unit", "standard_error", "low", "high"}
    assert data["errors"]["run 1"]["force"]["rms"] > 0
    assert data["status"] == "SOLVED"
    assert {t["name"] for t in data["verdict"]["tests"]} >= {"whiteness"}


def test_a_page_is_made_of_a_file_too(fit: Fitted, file: Path, tmp_path: Path) -> None:
    back = Fitted.from_json(file)
    back.to_html(tmp_path / "back.html")
    fit.to_html(tmp_path / "fit.html")
    sizes = [(tmp_path / name).stat().st_size for name in ("back.html", "fit.html")]
    assert abs(sizes[0] - sizes[1]) < 0.01 * sizes[1]


def test_what_needs_data_says_so(file: Path) -> None:
    back = Fitted.from_json(file)
    with pytest.raises(ValueError, match="validate: expected a fit of this process"):
        back.validate(None)  # pyright: ignore[reportArgumentType]
    with pytest.raises(ValueError, match="model: expected a fit of this process"):
        _ = back.model


@pytest.mark.parametrize("key", ["law_data", "parameters", "series", "status", "errors"])
def test_a_damaged_part_is_refused(key: str, file: Path) -> None:
    data = json.loads(file.read_text())
    data[key] = {"kind": "stribeck", "mu_d": -1.0} if key == "law_data" else [3]
    file.write_text(json.dumps(data))
    with pytest.raises(ValueError, match="expected the output of fit"):
        Fitted.from_json(file)


def test_a_fit_of_another_machine_is_stored_with_its_law(fit: Fitted, tmp_path: Path) -> None:
    other = replace(fit, machine=Rabinowicz(Stribeck()), live=None)
    other.to_json(tmp_path / "other.json")
    back = Fitted.from_json(tmp_path / "other.json")
    assert back.machine is None
    assert repr(back.law) == repr(fit.law)
    assert [v.name for v in other.model.x] == ["x", "v"]


def test_a_law_of_an_unknown_class_leaves_the_rest(file: Path) -> None:
    data = json.loads(file.read_text())
    data["law_data"]["kind"] = "MyLaw"
    file.write_text(json.dumps(data))
    back = Fitted.from_json(file)
    assert back.law is None
    assert back.values["mu_s"] > 20


@final
@dataclass(frozen=True)
class Inner:
    """A leaf."""

    name: str
    x: float = nan
    limit: float | None = None


@final
@dataclass(frozen=True, eq=False)
class Outer:
    """Everything that results hold."""

    status: Status
    inner: tuple[Inner, ...]
    by_pair: dict[tuple[str, str], Inner]
    y: NDArray[np.float64]
    matrix: NDArray[np.float64]
    flags: tuple[bool, int, str] = (True, 1, "a")
    none: Inner | None = None
    free: dict[str, Any] = field(default_factory=dict[str, Any])


def test_every_kind_of_field_comes_back() -> None:
    one = Outer(
        Status.SOLVED,
        (Inner("a", 1.5, inf), Inner("b")),
        {("run 1", "force"): Inner("c", -inf, 0.1)},
        np.array([1.0, nan, -inf]),
        np.array([[1.0, 0.5], [nan, 1.0]]),
        free={"n": 3, "text": "<b>"},
    )
    text = json.dumps(plain(one), allow_nan=False)
    back: Outer = revived(Outer, json.loads(text))
    assert back.status is Status.SOLVED
    assert (back.inner[0].x, back.inner[0].limit) == (1.5, inf)
    assert isnan(back.inner[1].x)
    assert back.inner[1].limit is None
    assert back.by_pair["run 1", "force"].x == -inf
    np.testing.assert_array_equal(back.y, one.y)
    np.testing.assert_array_equal(back.matrix, one.matrix)
    assert back.flags == (True, 1, "a")
    assert back.none is None
    assert back.free == {"n": 3, "text": "<b>"}
    assert json.dumps(plain(back)) == text


def test_numbers_keep_all_digits_and_arrays_six() -> None:
    assert plain(0.1 + 0.2) == 0.1 + 0.2
    assert plain(np.array([1 / 3])) == [0.333333]


def test_what_is_no_data_is_refused() -> None:
    with pytest.raises(TypeError, match="object"):
        plain(object())


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
    back = from_data(json.loads(json.dumps(plain(law))))
    assert type(back) is type(law)
    assert {n: p.value for n, p in parameters(back).items()} == {
        n: p.value for n, p in parameters(law).items()
    }
    assert json.dumps(plain(back)) == json.dumps(plain(law))


def test_a_drive_comes_back_with_its_law() -> None:
    drive = Drive(GMS(elements=(Element(3e4, 0.5),) * 3), m=3.0, N=1.0, offset=-2.0, turning=True)
    back = from_data(plain(drive))
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
    data = plain(Sum((Mine(mu=0.25), Viscous())))
    with pytest.raises(ValueError, match="Mine"):
        from_data(data)
    back = from_data(data, {"Mine": Mine})
    assert parameters(back)["mu"].value == 0.25


def test_what_is_not_known_is_refused_by_name() -> None:
    with pytest.raises(TypeError, match="expected plain data, got SX"):
        plain(with_values(Stribeck(), {"mu_s": ca.SX.sym("mu")}))


DATA = Dataset.of(t=[0.0, 1.0, 2.0], x=[0.0, 1.0, 0.0], force=[0.0, 1.0, 0.0])
NAMES = {
    kind.__name__: kind
    for kind in (Fit, InverseDynamics, Shooting, LuGre, log, linear, above, tied)
}


@pytest.mark.parametrize(
    "text",
    [
        "Fit(InverseDynamics(), 'stribeck', data)",
        "Fit(InverseDynamics(x='pos'), 'lugre', data, normal_force=5.0, loss='huber', starts=8)",
        "Fit(Shooting(windows=4.0, dead_time=(0.0, 0.01)), 'gms', data, noise={'x': 1e-06})",
        "Fit(InverseDynamics(), 'lugre', data, free={'m': log(1.0, 10.0), 'mu_s': above('mu_d')})",
        "Fit(InverseDynamics(), 'lugre', data, free={'m': linear(1.0, 10.0, start=2.0), "
        "'mu_s': above('mu_d', 3.0), 'sigma_2': tied('m', 2.0)}, fixed='others')",
    ],
)
def test_what_is_written_is_what_was_called(text: str) -> None:
    made = eval(text, {**NAMES, "data": DATA})
    assert written(made) == text


def test_long_arrays_are_three_dots() -> None:
    kind = Shooting(inputs={"force": Linear(np.arange(50.0), np.zeros(50))})
    assert written(kind) == "Shooting(inputs={'force': Linear(..., ...)})"


def test_models_and_functions_have_their_names() -> None:
    assert written(Fit(InverseDynamics(), rabinowicz(LuGre()), DATA)).startswith(
        "Fit(InverseDynamics(), rabinowicz, data"
    )
    assert "tied(<lambda>)" in written({"m": tied(lambda p: p["a"])})
    law = LuGre(sigma_0=3e4)
    assert eval(written(law), {"LuGre": LuGre}).sigma_0 == 3e4
