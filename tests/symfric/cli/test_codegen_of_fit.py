"""`symfric codegen FIT.json`: the C of a fitted law gives the numbers of the law."""

import ctypes
import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from fits import make

from identification.result.fitted import Fitted
from symfric.cli import main

compiled = pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")


@pytest.fixture(scope="module")
def fit(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("fit") / "fit.json"
    make(records=1, starts=1, n=800).to_json(path)
    return path


@compiled
def test_compiled_c_gives_the_numbers_of_the_fitted_law(
    fit: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["codegen", str(fit), "--out", str(tmp_path), "--real", "double"]) == 0
    assert "mu_s, mu_d: fitted as forces under a load of 1 N" in capsys.readouterr().err
    library = tmp_path / "law.so"
    source = str(tmp_path / "stribeck_f64.c")
    subprocess.run(
        ["gcc", "-shared", "-fPIC", "-O2", source, "-o", str(library), "-lm"], check=True
    )
    force = ctypes.CDLL(str(library)).stribeck_f64
    force.restype, force.argtypes = ctypes.c_double, [ctypes.c_double] * 2 + [ctypes.c_void_p]
    defaults = ctypes.addressof(
        ctypes.c_char.in_dll(ctypes.CDLL(str(library)), "stribeck_f64_default")
    )
    law = Fitted.from_json(fit).law
    assert law is not None
    v = np.concatenate([-np.geomspace(1e-7, 0.2, 50), [0.0], np.geomspace(1e-7, 0.2, 50)])
    in_c = [force(x, 1.0, defaults) for x in v.tolist()]
    np.testing.assert_allclose(in_c, np.asarray(law.force(v, 1.0)), rtol=1e-13, atol=1e-15)
    assert abs(in_c[-1]) > 20


@compiled
def test_the_plant_of_a_fit_holds_the_law_and_settings_change_it(fit: Path, tmp_path: Path) -> None:
    line = ["codegen", str(fit), "--scene", "drive", "--set", "m=3", "--set", "N=1"]
    assert main([*line, "--out", str(tmp_path), "--step-size", "0.001"]) == 0
    manifest = json.loads((tmp_path / "drive_manifest.json").read_text())
    values = {p["name"]: p["default"] for p in manifest["parameters"]} | manifest["constants"]
    assert values["m"] == 3.0
    assert values["mu_s"] == Fitted.from_json(fit).values["mu_s"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "expected --law NAME or the file of a fit, got neither"),
        (["FIT", "--law", "lugre"], "got both"),
        (["none.json"], "no such file"),
        (["robot.urdf"], "expected --inverse-dynamics with a robot"),
        (["FIT", "--set", "mu_z=1"], "mu_s"),
        (["FIT", "--scene", "drive", "--set", "m=3"], "got forces mu_s, mu_d"),
    ],
)
def test_bad_requests_are_one_sentence(
    arguments: list[str], message: str, fit: Path, tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    given = [str(fit) if a == "FIT" else a for a in arguments]
    assert main(["codegen", *given, "--out", str(tmp_path)]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert message in err
    assert err.count("\n") == 1


def test_a_fit_that_is_doubtful_becomes_c_with_a_word(
    fit: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    line = ["codegen", "--real", "double", "--no-kit", "--out", str(tmp_path / "c")]
    for status, said in (("SOLVED", False), ("DOUBTFUL", True)):
        changed = json.loads(fit.read_text(encoding="utf-8"))
        changed["status"] = status
        (tmp_path / "f.json").write_text(json.dumps(changed), encoding="utf-8")
        main([*line, str(tmp_path / "f.json")])
        assert ("status of the fit DOUBTFUL" in " ".join(capsys.readouterr().err.split())) is said
