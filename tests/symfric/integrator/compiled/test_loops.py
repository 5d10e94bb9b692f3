"""Long C functions divided into loops: short, with the bits of CasADi's virtual machine."""

from collections.abc import Callable

import casadi as ca
import numpy as np
import pytest

from symfric import BrownMcPhee
from symfric.bench.multibody import chain, integrator
from symfric.foundation.instructions import CODES, OPERATIONS, UNARY
from symfric.foundation.numeric import applied
from symfric.integrator.compiled import loops
from symfric.integrator.compiled.columns import Columns, rows_source

N = 240
"""Number of repetitions."""
NAMES = sorted({*OPERATIONS} - {"erfinv"})
"""Operations of which C has all."""
Terms = Callable[[ca.SX, ca.SX, ca.SX, int], ca.SX]


def recursion(terms: Terms, order: list[int]) -> ca.Function:
    """States after every step of a recursion, in this order, and a short function of the last."""
    u, p = ca.SX.sym("u", N), ca.SX.sym("p", 2)
    states = [p[0], p[1]]
    for k in range(N):
        states.append(terms(states[-1], states[-2], u[k], k))
    both = [ca.vertcat(*(states[2 + k] for k in order)), ca.fmax(states[-1], u[0])]
    return ca.Function("recursion", [u, p], both)


def smooth(x: ca.SX, before: ca.SX, u: ca.SX, _: int) -> ca.SX:
    return ca.sin(x - (-1.5)) * u + ca.sqrt(before * before + 2.0) / (3.0 + ca.fabs(x)) - u * x


def numbered(x: ca.SX, before: ca.SX, u: ca.SX, k: int) -> ca.SX:
    """Another number in each step, negative ones too."""
    return ca.cos(x - (-1.0) ** k / (k + 1)) * u - (before + 0.1 * k) * (x - u) / (1 + x * x)


def changing(x: ca.SX, before: ca.SX, u: ca.SX, k: int) -> ca.SX:
    """Other operations in the middle."""
    return smooth(x, before, u, k) if k not in (100, 101, 150) else ca.tanh(x + before * u)


def every(x: ca.SX, before: ca.SX, u: ca.SX, k: int) -> ca.SX:
    """One operation of CasADi after the other, comparisons, and an infinite constant."""
    name = NAMES[k % len(NAMES)]
    made = applied(CODES[name], (x,) if name in UNARY else (x, before))
    low = ca.fmin(u, -ca.inf if k == 7 else 0.1 * k)
    return ca.if_else(ca.logic_and(ca.fabs(made) < 3.0, made < ca.inf), made, u * x) + low


ORDERS = {
    "in order": [*range(N)],
    "reversed": [*range(N)][::-1],
    "shuffled": np.random.default_rng(3).permutation(N).tolist(),
}


@pytest.mark.parametrize(
    ("terms", "order"),
    [(smooth, "in order"), (smooth, "reversed"), (numbered, "shuffled"), (changing, "reversed"),
     (every, "in order")],
)  # fmt: skip
def test_loops_have_the_bits_of_the_virtual_machine(terms: Terms, order: str) -> None:
    columns = Columns(recursion(terms, ORDERS[order]))
    rng = np.random.default_rng(0)
    rows = [rng.normal(size=(5, N)), rng.normal(size=(5, 2))]
    vm, c = (columns(rows, backend=backend) for backend in ("vm", "compiled"))
    for expected, found in zip(vm, c, strict=True):
        np.testing.assert_array_equal(found, expected)
    source = rows_source(columns.function)
    assert "for (int r=0; r<" in source
    assert source.count("\n") < columns.function.n_instructions() / 2


def test_c_of_a_chain_has_loops_over_its_links() -> None:
    """Without loops it has 54,000 lines."""
    made = integrator(chain(20, BrownMcPhee()))
    assert made.prospect.write().count("\n") < 19_000


def test_sections_cover_all_statements_once() -> None:
    rng = np.random.default_rng(1)
    unit, mixed = rng.integers(9, size=70), rng.integers(9, size=500)
    form = np.concatenate([mixed, np.tile(unit, 8), mixed[:90], np.tile(unit[:40], 20)])
    found = loops.sections(form)
    ends = [section.end for section in found]
    assert [section.begin for section in found] == [0, *ends[:-1]]
    assert ends[-1] == form.size
    assert {(s.length, s.times) for s in found if s.times > 1} == {(70, 8), (40, 20)}
    for s in found:
        assert (s.folded(form) == s.folded(form)[0]).all()


def test_other_statements_stay_unchanged() -> None:
    body = "".join(f"  a{k}=arg[0]? arg[0][{k}] : 0;\n" for k in range(3 * loops.LONG))
    head = "static int f(const casadi_real** arg, int mem) {\n  casadi_real a0;\n"
    source = f"{head}{body}  if (fun(arg1, res1, iw, w, 0)) return 1;\n  return 0;\n}}\n"
    assert loops.with_loops(source) == source
    reads = "".join(f"  a{k}=arg[0]? arg[0][{k}] : 0;\n" for k in range(3))
    assert loops.parsed(f"{reads}  a1=fma(a0,a1,a2);\n") is None
