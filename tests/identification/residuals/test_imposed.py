import casadi as ca
import numpy as np
import pytest
from fits import evaluated
from tables import sampled

from identification.data.dataset import Dataset
from identification.residuals.evaluation import Evaluation
from identification.residuals.points import Points
from identification.unknowns.subject import subject
from symfric import GMS, BoucWen, Dahl, LuGre, law_from_text, simulate
from symfric.foundation.parameters import Variable, parameters
from symfric.integrator import Linear
from symfric.laws import Law
from symfric.laws.composed.populations import steady_force
from symfric.model import Model, Output

T = np.linspace(0.0, 1.0, 801)
V = 5e-2 * np.sin(2 * np.pi * 1.4 * T) + 2e-2 * np.sin(2 * np.pi * 6.2 * T)


def under(law: Law) -> Model:
    """The law alone after long rest, its velocity an input."""
    v = Variable("v", "m/s")
    starts = np.ravel(law.steady_state(0.0, 1.0))
    states = tuple(
        Variable(s.name, s.unit, nominal=s.nominal, start=float(start))
        for s, start in zip(law.states, starts, strict=True)
    )
    z = ca.vertcat(*(s.symbol for s in states))
    force = Output(ca.SX(law.force(v.symbol, 1.0, z)), "N", "friction force")
    rate = ca.SX(law.rate(v.symbol, 1.0, z))
    return Model(name="imposed", x=states, u=(v,), ode=rate, outputs={"F": force})


def imposed(law: Law, t: np.ndarray = T, v: np.ndarray = V) -> Evaluation:
    """The force of a law under imposed velocity, and its derivatives."""
    one = subject(law, points=True, moving=True)
    known = parameters(one.law)
    data = Dataset.of(t=t, v=v, F=0 * t, units={"v": "m/s", "F": "N"})
    rows = Points().prepare(one, data)
    values = [float(known[n].value) for n in one.names] + [u.start for u in rows.own]
    return evaluated(rows, np.array(values))


SOFT = LuGre(mu_s=0.4, mu_d=0.3, v_s=0.02, sigma_0=500.0, sigma_1=0.5, sigma_2=0.5)


@pytest.mark.parametrize(
    ("law", "limit"),
    sampled(
        [
            (LuGre(mu_s=0.4, mu_d=0.3, v_s=0.02, sigma_0=1e5, sigma_1=50.0), 2e-3),
            (SOFT, 3e-5),
            (GMS(), 2e-2),
            (BoucWen(), 1e-2),
            (law_from_text("armstrong"), 5e-3),
            (law_from_text("maxwell_slip"), 5e-3),
            (Dahl(mu_d=0.1, sigma_0=1e3), 1e-6),
            (law_from_text("rate_and_state"), 1e-3),
        ],
        of=2,
    ),
)
def test_a_law_under_imposed_velocity_is_the_law_simulated(law: Law, limit: float) -> None:
    numeric = subject(law, points=True, moving=True).law
    F = simulate(under(numeric), T[-1], u={"v": Linear(T, V)}, t_eval=T, rtol=1e-9)["F"]
    assert np.linalg.norm(imposed(law).r - F) < limit * np.linalg.norm(F)


def test_the_step_is_of_second_order_in_the_sample_time() -> None:
    def force(n: int) -> np.ndarray:
        t = np.linspace(0.0, 1.0, n)
        return imposed(SOFT, t, 0.05 * (1.2 + np.sin(2 * np.pi * 1.4 * t))).r[:: (n - 1) // 50]

    finest = force(6401)
    errors = np.array([np.abs(force(n) - finest).max() for n in (101, 201, 401)])
    assert (np.log2(errors[:-1] / errors[1:]) > 1.8).all()


def test_compiled_code_and_virtual_machine_give_the_same_bits(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found: list[bytes] = []
    for compiler in ("", "no-such-compiler"):
        monkeypatch.setenv("CC", compiler)
        end = imposed(SOFT)
        found.append(end.r.tobytes() + end.J.tobytes())
    assert found[0] == found[1]


def test_a_record_that_begins_in_motion_begins_in_steady_sliding() -> None:
    v = np.full(50, 0.05)
    np.testing.assert_allclose(imposed(SOFT, T[:50], v).r, steady_force(SOFT, v, 1.0), rtol=1e-9)
