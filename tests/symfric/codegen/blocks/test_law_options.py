"""Parameters and texts of blocks of laws, and contacts of populations."""

import casadi as ca
import numpy as np
import pytest
from tables import Names, table

from symfric import GenericAsperity, LuGre, RandomBristles, Stribeck, law_from_text, parameters
from symfric.codegen import contact_block, law_block
from symfric.foundation.graph import graph


def names_of(law, **options):
    return [p.name for p in law_block(law, **options).parameters]


@pytest.mark.parametrize("text", table(__file__)["constants"])
def test_only_values_that_save_a_function_call_or_have_no_effect_become_constants(text):
    law = Names().value(text)
    assert {*parameters(law)} - {*names_of(law)} == {*table(__file__)["constants"][text]}


def test_free_and_fold_choose_parameters_and_constants_save_operations():
    law = LuGre()
    assert names_of(law, fold=("mu_s", "v_eps")) == [
        "mu_d", "v_s", "sigma_0", "sigma_1", "sigma_2", "h"
    ]  # fmt: skip
    assert law_block(law, fold=("mu_s", "v_eps")).constants == {
        "mu_s": 0.15, "v_eps": 1e-15, "delta": 2.0
    }  # fmt: skip
    assert names_of(law, fold=True) == ["h"]
    assert names_of(law, fold=True, h=1e-3) == []
    block = law_block(law, free=("mu_s", "delta"), h=2e-3)
    assert [p.name for p in block.parameters] == ["mu_s", "delta"]
    assert block.constants["h"] == 2e-3
    assert set(block.constants) == {"h", *parameters(law)} - {"mu_s", "delta"}

    def operations(**options) -> int:
        return graph(law_block(law, **options).step).operations

    counts = [operations(free=tuple(parameters(law))), operations(), operations(free=("mu_s",)),
              operations(free=(), h=1e-3)]  # fmt: skip
    assert counts == sorted(counts, reverse=True)
    assert len(set(counts)) == 4
    assert operations(fold=True, h=1e-3) == counts[-1] <= counts[0] - 8


def test_names_and_texts_are_those_of_the_law_and_its_parts():
    for text, name in (("lugre", "lugre"), ("coulomb+viscous", "coulomb_viscous"),
                       ("asymmetric(coulomb+viscous)", "asymmetric_coulomb_viscous")):  # fmt: skip
        assert law_block(law_from_text(text)).name == name
    block = law_block(law_from_text("asymmetric(coulomb+viscous)"))
    assert block.equations.count("F = mu_d N s(v / v_eps)") == 1
    assert block.equations.count("F = sigma_2 v") == 1
    assert block.doc.startswith("Law with different parameters")
    static = law_block(Stribeck(sigma_2=0.4))
    assert static.is_function
    F = float(static.step([], [float(p.start) for p in static.parameters], [3e-4, 8.0])[1])
    assert pytest.approx(float(Stribeck(sigma_2=0.4).force(3e-4, 8.0)), rel=1e-14) == F


def test_contacts_in_a_loop_are_the_population_of_numpy():
    law, h, N = GenericAsperity(seed=5), 1e-4, 10.0
    block, n = contact_block(law, h=h), 200
    t = np.arange(n + 1) * h
    x = 2e-5 * np.sin(40 * t)
    start, v = law.begin(), np.diff(x) / h
    step, z, F = block.step.map(len(start.r)), start.z, np.zeros(n)
    for k in range(n):
        u = np.stack([np.full(len(start.r), v[k]), np.full(len(start.r), N), start.r])
        z, f = step(z, np.zeros((0, len(start.r))), u)
        F[k] = float(ca.sum2(f))
    np.testing.assert_allclose(F, law.force(t, x, N)[1:], rtol=1e-9, atol=1e-12)
    other = contact_block(RandomBristles(), h=1e-3)
    assert any("draw r anew" in text for text in other.use)
    assert (other.constants["count"], other.constants["h"]) == (25.0, 1e-3)
    assert [v.name for v in other.inputs] == ["v", "N", "r"]
    assert [v.name for v in contact_block(law, name="one").parameters] == ["h"]
