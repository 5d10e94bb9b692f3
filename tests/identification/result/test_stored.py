"""A fit as JSON and back; its parts, laws and calls as plain data and Python."""

import json
from dataclasses import replace
from math import inf, isnan, nan
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from fits import make

import symfric as sf
from identification.data.dataset import Dataset
from identification.fit import Fit
from identification.residuals.inverse import InverseDynamics
from identification.residuals.shooting import Shooting
from identification.result.build import written
from identification.result.fitted import Fitted
from identification.result.page import page_of
from identification.result.parts import Error, Errors, Line
from identification.result.stored import from_data, plain, revived
from identification.unknowns.spec import above, linear, log, tied
from symfric import LuGre
from symfric.foundation.parameters import parameters, with_values
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
    assert np.array_equal(back.law.force(v, 1.0), fit.law.force(v, 1.0))
    assert back.made["call"] == "Fit(...)"
    assert abs(len(page_of(back)) - len(page_of(fit))) < 0.01 * len(page_of(fit))
    with pytest.raises(ValueError, match="validate: expected a fit of this process"):
        back.validate(None)  # pyright: ignore[reportArgumentType]
    with pytest.raises(ValueError, match="model: expected a fit of this process"):
        _ = back.model


def test_the_file_is_plain_json_with_names_that_a_program_finds(file: Path) -> None:
    data = json.loads(file.read_text())
    assert (data["file"], data["format"], data["law"]) == ("symfric fit", 1, "stribeck")
    assert data["parameters"]["mu_s"].keys() >= {"value", "unit", "standard_error", "low", "high"}
    assert data["errors"]["run 1"]["force"]["rms"] > 0
    assert data["status"] == "SOLVED"
    assert {t["name"] for t in data["verdict"]["tests"]} >= {"whiteness"}


@pytest.mark.parametrize("key", ["law_data", "parameters", "series", "status", "errors"])
def test_a_damaged_part_is_refused(key: str, file: Path) -> None:
    data = json.loads(file.read_text())
    data[key] = {"kind": "stribeck", "mu_d": -1.0} if key == "law_data" else [3]
    file.write_text(json.dumps(data))
    with pytest.raises(ValueError, match="expected the output of fit"):
        Fitted.from_json(file)


def test_a_fit_of_another_machine_is_stored_with_its_law(fit: Fitted, tmp_path: Path) -> None:
    other = replace(fit, machine=Rabinowicz(sf.Stribeck()), live=None)
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


def test_numbers_keep_all_digits_also_where_json_has_none() -> None:
    one = {("a", "force"): Error("N", 0.1 + 0.2, inf, -inf, 3)}
    back = revived(Errors, json.loads(json.dumps(plain(one), allow_nan=False)))["a", "force"]
    assert (back.rms, back.relative, back.largest, back.rows) == (0.1 + 0.2, inf, -inf, 3)
    assert isnan(back.effective)
    line = revived(Line, plain(Line(np.array([1 / 3, nan, -inf]), np.zeros(0))))
    np.testing.assert_array_equal(line.t, [0.333333, nan, -inf])  # lines are only drawn
    for bad in (object(), with_values(sf.Stribeck(), {"mu_s": ca.SX.sym("mu")})):
        with pytest.raises(TypeError, match="expected plain data, got"):
            plain(bad)


LAWS: list[sf.Law | Drive] = [
    *(kind() for kind in sf.ALL_LAWS.values()),
    sf.GMS(elements=tuple(sf.Element(1e4 * k, 0.1 * k) for k in range(1, 11)), form="event"),
    sf.Asymmetric(sf.Stribeck(mu_s=0.3), sf.Stribeck(mu_s=0.2)),
    sf.Sum((sf.Coulomb(mu_d=0.123456789012345), sf.Viscous(sigma_2=1e-17))),
    law_from_text("lagged(stribeck)"),
    law_from_text("load_dependent(lugre)"),
    law_from_text("temperature_dependent(coulomb+viscous)"),
    sf.Table(speeds=(0.0, 0.1, 0.3), coefficients=(0.3, 0.2, 0.25)),
    Drive(sf.GMS(elements=(sf.Element(3e4, 0.5),) * 3), m=3.0, N=1.0, offset=-2.0, turning=True),
]


def test_every_law_comes_back_bit_for_bit() -> None:
    for law in LAWS:
        back = from_data(json.loads(json.dumps(plain(law))))
        assert type(back) is type(law)
        assert repr(back) == repr(law)
        values, expected = ({n: p.value for n, p in parameters(x).items()} for x in (back, law))
        assert values == expected


def test_a_user_law_is_restored_if_its_class_is_given() -> None:
    Mine = type("Mine", (sf.Coulomb,), {})
    data = plain(sf.Sum((Mine(mu_d=0.25), sf.Viscous())))
    with pytest.raises(ValueError, match="Mine"):
        from_data(data)
    back = from_data(data, {"Mine": Mine})
    assert isinstance(back.laws[0], Mine)


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


def test_arrays_models_and_functions_are_written_in_short() -> None:
    kind = Shooting(inputs={"force": sf.Linear(np.arange(50.0), np.zeros(50))})
    assert written(kind) == "Shooting(inputs={'force': Linear(..., ...)})"
    whole = written(Fit(InverseDynamics(), sf.rabinowicz(LuGre()), DATA))
    assert whole.startswith("Fit(InverseDynamics(), rabinowicz, data")
    assert "tied(<lambda>)" in written({"m": tied(lambda p: p["a"])})
    assert eval(written(LuGre(sigma_0=3e4)), {"LuGre": LuGre}).sigma_0 == 3e4
