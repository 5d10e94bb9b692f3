"""Numbers of an expression as data: the same value to the bit, and the same structure."""

from collections.abc import Callable

import casadi as ca
import numpy as np
import pytest

from symfric import LuGre, Viscous, drive, simulate
from symfric.foundation.programs import find_compiler
from symfric.integrator.compiled import compiler
from symfric.integrator.equations import expressions
from symfric.integrator.equations.expressions import lifted
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.running.integrator import Integrator

t, x = ca.SX.sym("t"), ca.SX.sym("x")
EXPRESSIONS: dict[str, ca.SX] = {
    "sine": 3.7 * ca.sin(2.3 * t + 0.1),
    "twice": 2 * t + (t + t),
    "powers": t**2 + t**2.5 + 1.7**t + (t + 0.3) ** -3,
    "choice": ca.if_else(t > 0.4, ca.sin(3 * t), 5 - x),
    "steps": ca.pw_const(t, [0.2, 0.4], [1.5, -2, 5]),
    "bounded": ca.fmin(ca.fmax(3 * t, -0.7), 0.9) / 3 + ca.atan2(t, 3),
    "number": ca.SX(5.5),
    "nothing": ca.sin(t) * t - x,
    "infinite": ca.fmin(t, ca.inf),
    "feedback": 3 * (1 - x) + ca.floor(4 * t) + ca.fmod(t, 0.3),
}


@pytest.mark.parametrize("name", EXPRESSIONS)
def test_values_have_the_same_bits(name: str) -> None:
    expression, known = EXPRESSIONS[name], ca.vertcat(t, x)
    made, symbols, numbers = lifted(expression, known, "u")
    assert symbols.numel() == numbers.size
    before, after = (
        ca.Function("b", [known], [expression]),
        ca.Function("a", [known, symbols], [made]),
    )
    for at in np.random.default_rng(0).uniform(0.0, 1.0, (20, 2)):
        assert float(after(at, numbers)) == float(before(at))


def test_exponents_are_structure_and_other_numbers_data() -> None:
    made, _, numbers = lifted(3 * t**2.5, t, "u")
    assert numbers.tolist() == [3.0]
    assert not ca.jacobian(made, t).is_constant()
    assert lifted(ca.sin(t) + t**2, t, "u")[2].size == 0


def test_coincidences_are_no_structure() -> None:
    """Twice the same number, 2 (which CasADi writes as a sum) and negative ones."""

    def of(a: float, b: float, c: float) -> tuple[str, list[float]]:
        made, _, numbers = lifted(a * ca.sin(b * t + c), t, "u")
        return ca.SX.serialize(made), numbers.tolist()

    found = [of(*numbers) for numbers in ((1.5, 3.0, 0.2), (3.0, 3.0, 3.0), (2.0, 2.0, -7.0))]
    assert len({structure for structure, _ in found}) == 1
    assert sorted(found[2][1]) == [-7.0, 2.0, 2.0]


def test_tables_stay_as_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(expressions, "MOST_NUMBERS", 3)
    expression = 3 * ca.sin(4 * t) + 5 * ca.cos(6 * t)
    made, symbols, numbers = lifted(expression, t, "u")
    assert (made is expression, symbols.shape, numbers.size) == (True, (0, 1), 0)


def driven(amplitude: float, frequency: float) -> dict[str, Callable[[ca.SX], ca.SX]]:
    """A sine that begins late."""
    late = 0.02 * frequency
    return {"force": lambda t: ca.if_else(t > late, amplitude * ca.sin(frequency * t), 0)}


def test_twenty_amplitudes_are_one_integrator_and_one_call_of_the_compiler(
    monkeypatch: pytest.MonkeyPatch, tmp_path: object
) -> None:
    builds, compilations = list[str](), list[str]()
    build, make = Integrator.__post_init__, compiler._made  # pyright: ignore[reportPrivateUsage]
    monkeypatch.setenv("SYMFRIC_CACHE", str(tmp_path))
    monkeypatch.setattr(
        Integrator, "__post_init__", lambda self: builds.append(self.model.name) or build(self)
    )
    monkeypatch.setattr(compiler, "_made", lambda *a: compilations.append(a[1]) or make(*a))
    backend, model = "vm" if find_compiler() is None else "compiled", drive(Viscous())
    ends = set[float]()
    for k in range(20):
        given = driven(2.0 + k, 5.0 + k)
        run = simulate(model, 0.5, u=given, samples=2, backend=backend)
        ends.add(run.final["x"])
        begins = input_data(model, given, 0.0, 0.5).breaks[1]
        assert 0.8 * 0.02 * (5 + k) < begins <= 0.02 * (5 + k)  # seen for each anew
    assert len(ends) == 20
    assert len(builds) == 1
    assert len(compilations) == (backend == "compiled")


def test_numbers_in_a_motion_are_those_that_were_given() -> None:
    """x'' = 12 sin(3 t) against friction, as data and written out."""
    model = drive(LuGre())
    simulate(model, 1.0, u={"force": lambda t: 5 * ca.sin(7 * t)}, backend="vm")
    again = simulate(model, 1.0, u={"force": lambda t: 12 * ca.sin(3 * t)}, backend="vm")
    fresh = simulate(drive(LuGre()), 1.0, u={"force": lambda t: 12 * ca.sin(3 * t)}, backend="vm")
    np.testing.assert_array_equal(again["x"], fresh["x"])
    assert again["force"] == pytest.approx(12 * np.sin(3 * again.t), abs=1e-12)
