"""Every law's C equals CasADi; what is wrong with C is found."""

import json

import numpy as np
import pytest
from law_cases import CASES, NO_STEP

from symfric import BrownMcPhee, LuGre, Stribeck, law_from_text
from symfric.codegen import generate, law_block, verify
from symfric.codegen.proof.verify import excitation

pytestmark = pytest.mark.heavy

STEEP = {"lagged(stribeck)"}
"""A filtered velocity of 2 m/s in float is known to 1e-7 m/s, a thousandth of the law's width."""

LAWS = {name: law for name, law in CASES.items() if name not in NO_STEP}
QUICK = {
    *("stribeck", "brown_mcphee", "self_tuning", "threlfall", "karnopp", "lugre", "dahl, n 0.5"),
    *("maxwell_slip", "bouc_wen", "gonthier", "lagged(stribeck)", "asymmetric(lugre)"),
}
"""One of each kind of expression and of step; `make stress` verifies all."""


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=[] if name in QUICK else pytest.mark.slow) for name in LAWS],
)
def test_every_law_is_verified(name, compiler, tmp_path):
    found = verify(generate(LAWS[name], tmp_path))
    double, single = found.checks
    assert found.ok or name in STEEP, found.table()
    assert (double.ulp, double.error, double.warnings) == (0, 0.0, ())
    assert single.error <= (2e-4 if name in STEEP else 4e-6)
    assert single.warnings == ()
    assert not single.foreign


def test_with_each_compiler(each_compiler, tmp_path):
    found = verify(generate(LuGre(), tmp_path), compiler=each_compiler)
    assert found.ok, found.table()
    assert found.compiler == each_compiler


@pytest.mark.parametrize("options", [{"free": ()}, {"h": 1e-4}, {"free": (), "h": 1e-4}])
def test_folded_parameters_are_verified(options, compiler, tmp_path):
    assert verify(generate(LuGre(), tmp_path, **options)).ok


def test_inputs_hold_zeros_reversals_tiny_and_large_velocities():
    v, N = excitation(law_block(LuGre())).T
    assert (v == 0).sum() > 1000
    assert (np.abs(v) >= 1.5).sum() > 100
    assert ((np.abs(v) > 0) & (np.abs(v) < 1e-6)).sum() > 1000
    assert (v[1:] * v[:-1] < 0).sum() > 1000
    assert N.min() > 0
    assert N.max() > 2.5 * N.min()


def tampered(made, real, old, new):
    file = made.source(real)
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))
    return verify(made)


def test_a_wrong_last_bit_is_found(compiler, tmp_path):
    made = generate(Stribeck(), tmp_path, real="double", free=())
    found = tampered(made, "double", "0.1 +", "0.10000000000000002 +")
    assert not found.ok
    assert 1 <= found.checks[0].ulp < 10
    assert found.status == "failed in double"


def test_a_wrong_default_is_found(compiler, tmp_path):
    made = generate(BrownMcPhee(), tmp_path, real="float")
    assert not tampered(made, "float", "0.15f, ", "0.16f, ").ok


def test_a_wrong_reset_is_found(compiler, tmp_path):
    made = generate(LuGre(), tmp_path, real="double")
    assert not tampered(made, "double", "state->z = N * t2 /", "state->z = 2.0 * N * t2 /").ok


def test_a_warning_is_found(compiler, tmp_path):
    made = generate(BrownMcPhee(), tmp_path, real="float")
    found = tampered(
        made, "float", "const float t1 =", "const float unused = 1.0; const float t1 ="
    )
    assert not found.ok
    assert found.checks[0].warnings


def test_double_functions_in_float_code_are_found(compiler, tmp_path):
    made = generate(BrownMcPhee(), tmp_path, real="float")
    found = tampered(made, "float", "SF_TANHF tanhf", "SF_TANHF (float)tanh")
    if found.checks[0].foreign is None:
        pytest.skip("no nm on this machine")
    assert found.checks[0].foreign == ("tanh",)
    assert not found.ok


def test_not_a_number_is_found(compiler, tmp_path):
    made = generate(BrownMcPhee(), tmp_path, real="double")
    found = tampered(made, "double", "return ", "return 0.0 * HUGE_VAL + ")
    assert not found.ok
    assert found.checks[0].error == np.inf


def test_without_a_compiler_it_says_so(monkeypatch, tmp_path):
    made = generate(LuGre(), tmp_path)
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CC", raising=False)
    found = verify(made)
    assert not found.ok
    assert found.checks == ()
    assert (
        found.table() == "lugre: not verified: no C compiler found; install gcc or clang, or set CC"
    )


def test_c_that_does_not_compile_is_no_proof(compiler, tmp_path):
    found = tampered(generate(LuGre(), tmp_path), "double", "const double", "konst double")
    assert not found.ok
    assert found.status.startswith("not verified: ")
    assert "konst" in found.status


def test_an_unknown_compiler_is_bad_input(tmp_path):
    with pytest.raises(ValueError, match="got 'no-such-compiler'"):
        verify(generate(LuGre(), tmp_path), compiler="no-such-compiler")


def test_the_result_goes_to_json_and_to_a_table(compiler, tmp_path):
    found = verify(generate(law_from_text("coulomb+viscous"), tmp_path))
    content = json.loads(json.dumps(found.to_dict()))
    assert content["ok"] is True
    assert [check["real"] for check in content["checks"]] == ["double", "float"]
    assert content["checks"][0]["ulp"] == 0
    table = found.table().splitlines()
    assert table[0] == f"coulomb_viscous: verified ({found.compiler})"
    assert table[2].split()[:4] == ["double", "20000", "0", "equal"]
    assert len(table) == 4
