"""Forces: power is minus the rate of their energy, actuators do what their rate says."""

from functools import cache

import casadi as ca
import pytest
from chains import chain, state

from symfric.multibody import Gravity, JointSpringDamper, SpringDamper
from symfric.multibody.equations import equations
from symfric.multibody.forces import Force
from symfric.multibody.prepare import Prepared

CONSERVATIVE: dict[str, Force] = {
    "gravity": Gravity("g", (0.1, 0.2, -9.0)),
    "spring": SpringDamper("s", "ground.out", "b4.out", 30.0, 0.5),
    "spring without length": SpringDamper("s", "b1.out", "b4", stiffness=30.0),
    "torsion": JointSpringDamper("t", "j0", "turn", 5.0, 0.3),
    "sliding spring": JointSpringDamper("t", "j2", "slide", 5.0, 0.3),
    "torsion, of the only direction": JointSpringDamper("t", "j0", stiffness=5.0, rest=0.3),
    "spring in a turn of a cylinder": JointSpringDamper("t", "j2", "turn", 5.0, 0.3),
}


@cache
def prepared(formulation: str, reverse: bool) -> Prepared:
    return chain(reverse).prepare(formulation=formulation)


def power_of(
    force: Force, formulation: str = "joint", reverse: bool = False, start: bool = False
) -> tuple[float, float]:
    """Power of a force and rate of its energy, at the start or in a random state."""
    made = prepared(formulation, reverse)
    q, qd = (made.q0, made.qd0) if start else state(made)
    kin = made.eq.kin
    total = sum((load.power(kin) for load in force.loads(kin)), ca.SX(0))
    energy = force.energy(kin)
    turns = kin.turns.values() if kin.turns else ()
    rate = ca.jtimes(energy, kin.q, kin.qd)
    rate += sum(ca.jtimes(energy, turn.angle.symbol, turn.rate) for turn in turns)
    both = ca.substitute(
        [total, rate], [t.angle.symbol for t in turns], [t.angle.start for t in turns]
    )
    values = ca.Function("power", [kin.q, kin.qd], both)
    return tuple(float(x) for x in values.call([q, qd]))  # type: ignore[return-value]


@pytest.mark.parametrize("reverse", [False, True])
def test_power_is_minus_the_rate_of_the_energy(reverse: bool) -> None:
    for name, force in CONSERVATIVE.items():
        power, rate = power_of(force, reverse=reverse)
        assert power == pytest.approx(-rate, rel=1e-11), name
        assert abs(power) > 1e-3, name


def test_both_formulations_see_the_same_power() -> None:
    for name in ("torsion", "sliding spring", "spring"):
        ours, same = (power_of(CONSERVATIVE[name], f, start=True) for f in ("joint", "absolute"))
        assert ours[0] == pytest.approx(same[0], rel=1e-10)


def test_dampers_take_energy() -> None:
    for force in (SpringDamper("d", "ground.out", "b3.out", damping=2.0),
                  JointSpringDamper("d", "j1", damping=2.0)):  # fmt: skip
        power, rate = power_of(force)
        assert power < 0
        assert rate == 0.0


def test_absent_terms_cost_nothing() -> None:
    """A spring without damping has no velocity in it, one without length no root."""
    made = prepared("joint", False)
    topology, t, counts = made.eq.kin.topology, made.eq.kin.t, list[int]()
    for more in ((), (1.0,), (1.0, 2.0)):
        eq = equations(topology, [SpringDamper("s", "ground", "b1", 3.0, *more)], [],
                       made.eq.q, made.eq.qd, t)  # fmt: skip
        b = ca.Function("b", [eq.q, eq.qd, eq.a, eq.lam], [eq.balance])
        counts.append(b.n_instructions())
    assert counts == sorted(set(counts))
