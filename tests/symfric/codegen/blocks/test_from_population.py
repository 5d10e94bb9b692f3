"""Contacts as C: one by one they are CasADi's, and in a loop the population of NumPy."""

import subprocess

import numpy as np
import pytest

from symfric import GenericAsperity, RandomBristles
from symfric.codegen import contact_block, generate, verify
from symfric.codegen.runner import link_program

MAIN = """#include "generic_asperity_f64.h"
#include <stdio.h>
#define COUNT 1000
static generic_asperity_f64_state_t state[COUNT];
static double r[COUNT], motion[2];
int main(void)
{
    const generic_asperity_f64_param_t param = {1e-4};
    if (fread(state, sizeof state, 1, stdin) != 1) { return 1; }
    if (fread(r, sizeof r, 1, stdin) != 1) { return 1; }
    while (fread(motion, sizeof motion, 1, stdin) == 1) {
        double F = 0.0;
        for (int i = 0; i < COUNT; i++) {
            generic_asperity_f64_in_t in = {motion[0], motion[1], r[i]};
            generic_asperity_f64_out_t out;
            generic_asperity_f64_step(&state[i], &param, &in, &out);
            F += out.F;
        }
        fwrite(&F, sizeof F, 1, stdout);
    }
    return 0;
}
"""


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("law", "real"),
    [(GenericAsperity(), "double"), (RandomBristles(), "double"), (RandomBristles(), "float")],
)
def test_a_contact_is_verified(law, real, compiler, tmp_path):
    found = verify(generate(law, tmp_path, real=real, kit=False))
    assert found.ok, found.table()


@pytest.mark.heavy
def test_float_does_not_hold_the_phase_of_an_asperity_at_its_ends(compiler, tmp_path):
    """Where an asperity leaves, its stiffness and load jump: a last bit of the phase decides."""
    found = verify(generate(GenericAsperity(), tmp_path, real="float", kit=False))
    (check,) = found.checks
    assert not found.ok
    assert check.rounding is not None
    assert check.error < check.rounding
    assert "by rounding" in check.why


def test_a_loop_in_c_is_the_population_of_numpy(compiler, tmp_path):
    law, h, N = GenericAsperity(seed=5), 1e-4, 10.0
    made = generate(law, tmp_path, real="double", kit=False)
    (tmp_path / "main.c").write_text(MAIN)
    program = tmp_path / "main"
    link_program(compiler, [tmp_path / "main.c", made.source("double")], tmp_path, program)
    t = np.arange(2001) * h
    x = 2e-5 * np.sin(40 * t)
    velocities = np.stack([np.diff(x) / h, np.full(2000, N)], axis=1)
    start = law.begin()
    data = np.ascontiguousarray(start.z.T).tobytes() + start.r.tobytes() + velocities.tobytes()
    done = subprocess.run([str(program)], input=data, capture_output=True, check=True)
    F = np.frombuffer(done.stdout)
    np.testing.assert_allclose(F, law.force(t, x, N)[1:], rtol=1e-9, atol=1e-12)


def test_the_text_says_how_a_population_is_made():
    block = contact_block(RandomBristles(), h=1e-3)
    assert any("draw r anew" in text for text in block.use)
    assert block.constants["count"] == 25.0
    assert [v.name for v in block.inputs] == ["v", "N", "r"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"h": 0.0}, "h: expected a number > 0"),
        ({"free": ("k",)}, "expected with a law only, got a popul"),
    ],
)
def test_what_makes_no_sense_is_refused(options, message, tmp_path):
    with pytest.raises(ValueError, match=message):
        generate(GenericAsperity(), tmp_path, **options, kit=False)
