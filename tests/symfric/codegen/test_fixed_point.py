"""C in fixed point: errors within the proven bounds, functions over all arguments, refusals."""

from contextlib import suppress
from math import nan
from operator import add, mul, sub
from pathlib import Path
from random import Random
from string import Template

import casadi as ca
import numpy as np
import pytest

from symfric import BrownMcPhee, Karnopp, LuGre, MaxwellSlip, Stribeck
from symfric.codegen import fixed_point, generate
from symfric.codegen.blocks.block import TEMPLATES, Block
from symfric.codegen.fixed.generated import FixedPoint, compare, random_inputs
from symfric.codegen.fixed.operations import (
    ATAN,
    EXP,
    INVERSE,
    LOG2,
    POWER,
    SIN,
    TANH,
    WEIGHT,
)
from symfric.codegen.runner import compile_object, compiled, run_c
from symfric.foundation.numeric import Array
from symfric.foundation.parameters import Variable
from symfric.foundation.programs import finished
from symfric.laws import ALL_LAWS
from symfric.laws.catalogue import STATIC_LAWS
from symfric.model import Output

RANGES = {"v": (-0.5, 0.5), "N": (1.0, 20.0)}
ABSENT = {"karnopp", "awrejcewicz", "wojewoda", "quarter_car_general", "bam", "brush_tyre"}
"""Static laws with further inputs, which RANGES lacks."""
ENDS = {
    "coulomb": 9e-8, "stribeck": 1.7e-7, "brown_mcphee": 6.7e-5, "velocity_based": 1.7e-5,
    "self_tuning": 1.3e-6, "tustin": 8.1e-6, "network": 2e-6,
}  # fmt: skip
"""Largest proven error [N] of some laws under 20 N."""
AXIS = LuGre(mu_s=6, mu_d=4, v_s=5e-3, sigma_0=1e5, sigma_1=300, sigma_2=20)
ON_AXIS = {"v": (-0.5, 0.5), "N": (0.5, 1.5), "z": (-1e-4, 1e-4)}


def agrees(made: FixedPoint, compiler, count: int) -> None:
    errors, warnings = compare(made, compiler, random_inputs(made, count))
    assert not warnings
    assert all(0.0 < error <= made.errors[name] for name, error in errors.items())


@pytest.mark.parametrize(
    "name",
    [pytest.param(n, marks=pytest.mark.slow) if n in ("coulomb", "tustin", "self_tuning") else n
     for n in ENDS],
)  # fmt: skip
def test_no_error_exceeds_the_proven_bound(name, compiler, tmp_path):
    made = fixed_point(ALL_LAWS[name](), tmp_path, RANGES)
    assert made.errors["F"] <= ENDS[name]
    agrees(made, compiler, 3000)


def test_ranges_of_further_inputs_are_divided(compiler, tmp_path):
    made = fixed_point(Karnopp(), tmp_path, RANGES | {"F_e": (-5.0, 5.0)})
    assert made.errors["F"] < 0.02
    agrees(made, compiler, 3000)


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(STATIC_LAWS.keys() - ABSENT))
def test_no_error_of_any_static_law_exceeds_the_bound(name, compiler, tmp_path):
    agrees(fixed_point(ALL_LAWS[name](), tmp_path, RANGES), compiler, 1_000_000)


FORMULAS = {
    "sine": lambda x, y: ca.sin(4.0 * x),
    "far_limit": lambda x, y: ca.fmin(x, 1e3) + ca.fmax(y, -1e7),
    "far_tie": lambda x, y: ca.if_else(x < 1e3, y, 2.0 * y),
    "large_log": lambda x, y: ca.log(1e12 * (1.0 + x * x)),
    "vanishing": lambda x, y: ca.fmax(1e-12 * ca.exp(x) + 9.0 * y, 1e-12 * ca.exp(x) + 4.0),
    "two_selects": lambda x, y: ca.if_else(x < 0.25, y, 99 * x) + ca.if_else(x < 0.5, y, x),
    "exact": lambda x, y: x + y - 0.1,
    "small_power": lambda x, y: (1e-4 + x * x) ** -0.01 * y,
}  # fmt: skip
"""Formulas of x in -1 ... 1 and y in 0 ... 1."""


def formula(expression, out: Path) -> FixedPoint:
    x, y = (Variable(name, "1", nominal=1.0) for name in "xy")
    outputs = {"F": Output(expression(x.symbol, y.symbol), "1")}
    return fixed_point(
        Block("law", inputs=(x, y), outputs=outputs), out, {"x": (-1, 1), "y": (0, 1)}
    )


@pytest.mark.parametrize("name", FORMULAS)
def test_integers_do_not_overflow(name, compiler, tmp_path):
    agrees(formula(FORMULAS[name], tmp_path), compiler, 3000)


ONE = (
    ca.tanh, ca.atan, ca.fabs, ca.sign, lambda a: ca.exp(-ca.fabs(a)),
    lambda a: ca.sqrt(ca.fabs(a)), lambda a: ca.log(ca.fabs(a) + 0.1),
    lambda a: (ca.fabs(a) + 0.1) ** 1.7,
)  # fmt: skip
TWO = (
    add, add, sub, mul, mul, ca.fmin, ca.fmax, lambda a, b: a / (ca.fabs(b) + 0.1),
    lambda a, b: ca.if_else(a < b, a, b * b), lambda a, b: ca.if_else(a > 0.25, b, a),
)  # fmt: skip


def some(random: Random, leaves: list[ca.SX], depth: int) -> ca.SX:
    """Return a random formula."""
    if depth == 0:
        return random.choice([*leaves, ca.SX(round(10.0 ** random.uniform(-3.0, 3.0), 3))])
    operation = random.choice([*ONE, *TWO])
    count = 1 if operation in ONE else 2
    return operation(*(some(random, leaves, depth - 1) for _ in range(count)))


@pytest.mark.parametrize("count", [4, pytest.param(100, marks=pytest.mark.slow)])
def test_no_random_formula_exceeds_its_bound(count, compiler, tmp_path):
    """Formulas whose bound is refused do not count."""
    random, found = Random(1), 0
    while found < count:
        with suppress(ValueError):
            made = formula(lambda x, y: some(random, [x, y], random.randint(2, 5)), tmp_path)
            errors, warnings = compare(made, compiler, random_inputs(made, 3000))
            assert not warnings
            assert errors["F"] <= made.errors["F"]
            found += 1


def test_states_are_clamped_to_their_ranges(compiler, tmp_path):
    agrees(fixed_point(AXIS, tmp_path, ON_AXIS | {"z": (-2e-5, 1e-5)}, h=1e-3), compiler, 3000)


def test_the_bound_is_close_to_the_largest_error(compiler, tmp_path):
    made = fixed_point(BrownMcPhee(), tmp_path, RANGES)
    errors, _ = compare(made, compiler, random_inputs(made, 3000))
    assert errors["F"] > made.errors["F"] / 3


def test_inputs_of_any_bits_are_clamped(compiler, tmp_path):
    made = fixed_point(Stribeck(), tmp_path, RANGES)
    beyond = np.array([[-0.9, 60.0], [0.9, 0.0], [0.5, 20.0], [-0.5, 1.0]])
    scale = made.scales(["v", "N"])
    rows = followed(made, compiler, tmp_path, np.vstack([beyond * scale, [[2**31 - 1, -(2**31)]]]))
    inside = np.clip(beyond, (-0.5, 1.0), (0.5, 20.0)) * scale
    expected = followed(made, compiler, tmp_path, np.vstack([inside, [0.5, 1.0] * scale]))
    assert (rows == expected).all()


def followed(made: FixedPoint, compiler, folder: Path, whole: Array) -> Array:
    target = folder / "step.o"
    assert not compile_object(compiler, made.files[1], target)
    return run_c(made.c, compiled(made.c, [target], made.folder, compiler), whole)


def test_files_have_the_same_bytes_in_each_run(tmp_path):
    one, two = (fixed_point(Stribeck(), tmp_path / n, RANGES) for n in ("a", "b"))
    assert [f.read_bytes() for f in one.files] == [f.read_bytes() for f in two.files]


@pytest.mark.parametrize("count", [20_000, pytest.param(10_000_000, marks=pytest.mark.slow)])
def test_lugre_follows_double(count, compiler, tmp_path):
    """In motion through zero, errors do not add up; at rest, the state does not move at all."""
    made = fixed_point(AXIS, tmp_path, ON_AXIS, h=1e-3)
    agrees(made, compiler, 3000)
    t = 1e-3 * np.arange(count)
    v = 0.2 * np.sin(3.1 * t) + 0.02 * np.sin(23.2 * t)
    v[-1000:] = 0.0
    scale = made.scales(["v", "N"])
    whole = np.rint(np.column_stack([v, 1.0 + 0.4 * np.sin(1.9 * t)]) * scale)
    rows = followed(made, compiler, tmp_path, whole) / made.scales(["z", "F", "F_end"])
    c = generate(made.model, tmp_path, real="double", guards=False, kit=False).c("double")
    source = tmp_path / f"{c.name}.c"
    expected = run_c(c, compiled(c, [source], tmp_path, compiler), whole / scale)[:, :3]
    assert np.abs(rows - expected).max(axis=0) == pytest.approx(0.0, abs=2e-5)
    assert np.unique(rows[-900:, 0]).size == 1


@pytest.mark.parametrize("stride", [1009, pytest.param(1, marks=pytest.mark.slow)])
def test_errors_of_functions_are_those_of_the_proof(stride, compiler, tmp_path):
    """Every argument, or every 1009th, against the functions of libm."""
    text = (TEMPLATES / "fixed.c").read_text().replace("@{name}", "x")
    checks = Template(EVERY).substitute(stride=stride)
    (tmp_path / "main.c").write_text(f"#include <stdint.h>\n{text}\n{checks}")
    target = str(tmp_path / "main")
    compiler.run("-std=c99", "-O2", "-w", str(tmp_path / "main.c"), "-o", target, "-lm")
    found = finished([target], limit=3600).output.split()
    most = [INVERSE, EXP, TANH, SIN, ATAN, ATAN, LOG2, POWER, *[WEIGHT, WEIGHT, EXP] * 2]
    assert len(found) == len(most)
    assert all(0.0 < float(a) <= b for a, b in zip(found, most, strict=True))


EVERY = r"""
#include <math.h>
#include <stdio.h>
#define EACH(from, to, error) do { \
    double most = 0.0, e; int64_t k; \
    for (k = (from); k <= (to); k += $stride) { e = fabs(error); if (e > most) most = e; } \
    printf("%.4g\n", most); } while (0)
#define ONE 1073741824.0
static double first(double x)
{
    return x < 1e-3 ? 1 - x / 2 + x * x / 6 - x * x * x / 24 : -expm1(-x) / x;
}
static double second(double x)
{
    return x < 0.05 ? 0.5 - x / 6 + x * x / 24 - x * x * x / 120 + x * x * x * x / 720
        - x * x * x * x * x / 5040 : (1 - first(x)) / x;
}
static void weights(int f)
{
    const double s = pow(2, -f);
    EACH(0, 0x40000000, x_phi1((int32_t)k, f) / ONE - first(k * s));
    EACH(0, 0x40000000, x_phi2((int32_t)k, f) / ONE - second(k * s));
    EACH(0, 0x40000000, x_decay((int32_t)k, f) / ONE - exp(-k * s));
}
int main(void)
{
    EACH(0x80000000LL, 0xFFFFFFFFLL, x_inverse((uint32_t)k) / (9223372036854775808.0 / k) - 1);
    EACH(0, 0x40000000, x_exp((int32_t)-k) / ONE - exp(-k / 33554432.0));
    EACH(0, 0x40000000, x_tanh((int32_t)k) / ONE - tanh(k / 67108864.0));
    EACH(-0x40000000LL, 0x40000000, x_sin((int32_t)k) / ONE - sin(k / 268435456.0));
    EACH(0, 0x40000000, x_atan((int32_t)k, 20) / 536870912.0 - atan(k / 1048576.0));
    EACH(0, 0x40000000, x_atan((int32_t)k, 30) / 536870912.0 - atan(k / ONE));
    EACH(1, 0x7FFFFFFF, x_log2((int32_t)k, 20) / 67108864.0 - log2(k / 1048576.0));
    EACH(0, 0x7FFFFFFF, x_table(x_powers, (uint32_t)k) / 536870912.0 / exp2(k / 2147483648.0) - 1);
    weights(25);
    weights(18);
    return 0;
}
"""

EVENTS = RANGES | {f"{name}_{k}": (-9.0, 9.0) for name in ("F", "slip") for k in range(1, 5)}
WRONG = [
    (lambda out: fixed_point(Stribeck(), out, {"v": (-1, 1)}), r"a range of N \[N\], got none"),
    (lambda out: fixed_point(Stribeck(), out, RANGES | {"z": (0, 1)}), "expected one of v, N"),
    (lambda out: fixed_point(Stribeck(), out, {"v": (1, nan), "N": (3, 2)}), "v: .*; N: expected"),
    (lambda out: fixed_point(ALL_LAWS["mixed_lubrication"](), out, {"v": (-1, 1), "N": (0, 9)}),
     "bounded over the ranges, got .*; narrow the ranges"),
    (lambda out: formula(lambda x, y: (x + 3e9 * y) - 1e9 * y - 2e9 * y, out),
     "error of F below a tenth of its largest value, got .* 1; .* without jumps"),
    (lambda out: fixed_point(ALL_LAWS["quarter_car_general"](), out, RANGES),
     "range of x_rel"),
    (lambda out: fixed_point(LuGre(), out, RANGES), r"range of z \[m\], got none; expected a step"),
    (lambda out: formula(lambda x, y: ca.sin(4.1 * x), out), "beyond the domain of a function"),
    (lambda out: formula(lambda x, y: ca.sqrt(x), out), "beyond the domain of a function"),
    (lambda out: fixed_point(MaxwellSlip(form="event"), out, EVENTS, h=1e-3), "narrow the ranges"),
]  # fmt: skip


@pytest.mark.parametrize(("call", "text"), WRONG)
def test_bad_input_is_refused(call, text, tmp_path):
    with pytest.raises(ValueError, match=text):
        call(tmp_path)
