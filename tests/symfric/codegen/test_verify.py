"""Every law's C equals CasADi; what is wrong with C is found."""

import json

import casadi as ca
import numpy as np
import pytest
from law_cases import CASES, NO_STEP

from symfric import BrownMcPhee, LuGre, Output, Stribeck, Variable, law_from_text
from symfric.codegen import Block, generate, law_block, verify
from symfric.codegen.compared import excitation, spoiled, varied
from symfric.laws.base import smooth

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
    found = verify(generate(LAWS[name], tmp_path, kit=False))
    double, single = found.checks
    assert found.ok or name in STEEP, found.table()
    assert (double.ulp, double.error, double.warnings) == (0, 0.0, ())
    assert single.error <= (2e-4 if name in STEEP else 4e-6)
    assert single.warnings == ()
    assert not single.foreign


def test_with_each_compiler(each_compiler, tmp_path):
    found = verify(generate(LuGre(), tmp_path, kit=False), compiler=each_compiler)
    assert found.ok, found.table()
    assert found.compiler == each_compiler


@pytest.mark.parametrize("options", [{"free": ()}, {"h": 1e-4}, {"free": (), "h": 1e-4}])
def test_folded_parameters_are_verified(options, compiler, tmp_path):
    assert verify(generate(LuGre(), tmp_path, **options, kit=False)).ok


def test_inputs_hold_zeros_reversals_tiny_and_large_velocities():
    v, N = excitation(law_block(LuGre()), 20_000).T
    assert (v == 0).sum() > 1000
    assert (np.abs(v) >= 1.5).sum() > 100
    assert ((np.abs(v) > 0) & (np.abs(v) < 1e-6)).sum() > 1000
    assert (v[1:] * v[:-1] < 0).sum() > 1000
    assert (N == 0).sum() > 1000
    loads = N[N > 0]
    assert loads.max() > 1e5 * loads.min()
    jumps = N[1:] / np.where(N[:-1] > 0, N[:-1], np.inf)
    assert (jumps > 10).sum() > 10
    assert ((jumps > 0) & (jumps < 0.1)).sum() > 10


def test_bad_inputs_hold_what_is_not_finite_and_what_is_out_of_range():
    v, N = spoiled(law_block(LuGre()), excitation(law_block(LuGre()), 4000)).T
    for column in (v, N):
        assert 5 < np.isnan(column).sum() < 100
        assert (np.isinf(column)).sum() > 10
        assert (np.abs(column[np.isfinite(column)]) > 1e8).sum() > 10
    assert (N < 0).sum() > 10


def test_other_parameters_hold_step_sizes_over_three_decades():
    block = law_block(LuGre())
    names = [v.name for v in block.parameters]
    values = varied(block, 4000, 10.0)
    h = values[:, names.index("h")]
    assert 1e-5 <= h.min() < 3e-5
    assert 3e-3 < h.max() <= 1e-2
    assert len(np.unique(values[:, names.index("mu_s")])) == 40
    assert values[:, names.index("mu_s")] == pytest.approx(0.15, rel=0.21)


@pytest.mark.parametrize("name", ["haessig_friedland", "maxwell_slip"])
def test_a_law_that_dies_in_float_after_a_load_fell_is_found(name, compiler, monkeypatch, tmp_path):
    """So did both before |r|^n was bounded, and were called verified."""
    monkeypatch.setattr(smooth, "overload", smooth.power)
    found = verify(generate(LAWS[name], tmp_path, real="float", kit=False))
    assert found.status.startswith("failed in float: ")
    assert (
        verify(generate(LAWS[name], tmp_path, real="float", guards=False, kit=False))
        .checks[0]
        .error
        > 1
    )


def test_a_guard_that_does_nothing_is_found(compiler, tmp_path):
    made = generate(LuGre(), tmp_path, real="double", kit=False)
    found = tampered(made, "double", "*status |= clamped;", "")
    assert found.status.startswith("failed in double: status differs")


def test_a_guard_that_alters_valid_inputs_is_found(compiler, tmp_path):
    made = generate(BrownMcPhee(), tmp_path, real="double", kit=False)
    made.source("double").write_text(
        made.source("double").read_text().replace("_beyond(v, 1000000.0)", "_beyond(v, 1e-3)")
    )
    assert not tampered(
        made, "double", "_mended(v, -1000000.0, 1000000.0", "_mended(v, -1000000.0, 1e-3"
    ).ok


def test_the_worst_signal_is_named(compiler, tmp_path):
    made = generate(LuGre(), tmp_path, real="float", kit=False)
    found = tampered(made, "float", "out->F_end = ", "out->F_end = 1.0f + ")
    (check,) = found.checks
    assert check.worst == "F_end"
    assert "F_end is off by " in found.status
    assert "more than rounding explains" in found.status
    assert " F_end " in found.table()
    assert found.to_dict()["checks"][0]["worst"] == "F_end"


def test_rounding_is_told_from_a_wrong_formula(compiler, tmp_path):
    """A belt at 1 m/s and a contact that changes over 1 um/s: the last bit of v is 0.06 of it."""
    v, N = Variable("v", "m/s"), Variable("N", "N", lower=0.0, upper=10.0)
    force = N.symbol * ca.tanh((v.symbol - 1.0) / 1e-6)
    x = Variable("x", "m/s", start=1.0)
    moved = x.symbol + 1e-7 * ca.sin(1e3 * v.symbol)
    block = Block(
        "belt", states=(x,), inputs=(v, N), next=moved,
        outputs={"F": Output(ca.substitute(force, v.symbol, moved), "N")},
    )  # fmt: skip
    found = verify(generate(block, tmp_path, real="float", kit=False))
    assert found.status.startswith("failed in float: F is off by ")
    assert ", by rounding: float moves it by " in found.status


def test_what_is_left_of_a_difference_is_judged_by_its_terms(compiler, tmp_path):
    """A closing equation: 1e-9 of what it is the difference of, all of it rounding."""
    a = Variable("a", "m", nominal=0.3)
    left = (a.symbol + 1.1) * (a.symbol - 1.1) - a.symbol**2 + 1.21
    outputs = {"gap": Output(left, "m"), "two": Output(2.0 * a.symbol, "m")}
    made = generate(Block("loop", inputs=(a,), outputs=outputs), tmp_path, real="float", kit=False)
    (check,) = verify(made).checks
    assert check.ok
    assert check.worst == "gap"
    assert 1e-9 < check.error < 1e-6


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
    assert found.status == f"failed in double: F differs from CasADi by {found.checks[0].ulp} ulp"


def test_a_wrong_default_is_found(compiler, tmp_path):
    made = generate(BrownMcPhee(), tmp_path, real="float", kit=False)
    assert not tampered(made, "float", "0.15f, ", "0.16f, ").ok


def test_a_wrong_reset_is_found(compiler, tmp_path):
    made = generate(LuGre(), tmp_path, real="double", kit=False)
    assert not tampered(made, "double", "state->z = N * t2 /", "state->z = 2.0 * N * t2 /").ok


def test_a_warning_is_found(compiler, tmp_path):
    made = generate(BrownMcPhee(), tmp_path, real="float", kit=False)
    found = tampered(
        made, "float", "const float t1 =", "const float unused = 1.0; const float t1 ="
    )
    assert not found.ok
    assert found.checks[0].warnings


def test_double_functions_in_float_code_are_found(compiler, tmp_path):
    made = generate(BrownMcPhee(), tmp_path, real="float", kit=False)
    found = tampered(made, "float", "SF_TANHF tanhf", "SF_TANHF (float)tanh")
    if found.checks[0].foreign is None:
        pytest.skip("no nm on this machine")
    assert found.checks[0].foreign == ("tanh",)
    assert not found.ok


def test_not_a_number_is_found(compiler, tmp_path):
    made = generate(BrownMcPhee(), tmp_path, real="double", kit=False)
    found = tampered(made, "double", "return ", "return 0.0 * HUGE_VAL + ")
    assert not found.ok
    assert found.checks[0].error == np.inf


def test_without_a_compiler_it_says_so(monkeypatch, tmp_path):
    made = generate(LuGre(), tmp_path, kit=False)
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CC", raising=False)
    found = verify(made)
    assert not found.ok
    assert found.checks == ()
    assert (
        found.table() == "lugre: not verified: no C compiler found; install gcc or clang, or set CC"
    )


def test_a_compiler_named_by_the_environment_and_not_there_is_named(monkeypatch, tmp_path):
    made = generate(LuGre(), tmp_path, kit=False)
    monkeypatch.setenv("CC", "/no/such")
    assert "$CC is '/no/such', which does not exist" in verify(made).status


def test_c_that_does_not_compile_is_no_proof(compiler, tmp_path):
    found = tampered(
        generate(LuGre(), tmp_path, kit=False), "double", "const double", "konst double"
    )
    assert not found.ok
    assert found.status.startswith("not verified: ")
    assert "konst" in found.status


def test_an_unknown_compiler_is_bad_input(tmp_path):
    with pytest.raises(ValueError, match="got 'no-such-compiler'"):
        verify(generate(LuGre(), tmp_path, kit=False), compiler="no-such-compiler")


def test_the_result_goes_to_json_and_to_a_table(compiler, tmp_path, all_steps_verified):
    found = verify(generate(law_from_text("coulomb+viscous"), tmp_path, kit=False))
    content = json.loads(json.dumps(found.to_dict()))
    assert content["ok"] is True
    assert [check["real"] for check in content["checks"]] == ["double", "float"]
    assert content["checks"][0]["ulp"] == 0
    table = found.table().splitlines()
    assert table[0] == f"coulomb_viscous: verified ({found.compiler})"
    assert table[2].split()[:4] == ["double", "28000", "0", "equal"]
    assert len(table) == 4
