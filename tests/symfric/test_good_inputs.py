"""Valid input: every public function accepts the number types of Python, NumPy and CasADi."""

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
import pytest

import ocp
import symfric as sf
from identification import Dataset, Fit, InverseDynamics, Shooting, synthetic_drive_data
from symfric import multibody as mb
from symfric.codegen import law_block, plant_block
from symfric.figures import compare

KINDS: tuple[Callable[[float], Any], ...] = (
    float,
    np.float32,
    np.float64,
    np.float16,
    np.array,
    lambda x: np.array(x, np.float32),
    ca.DM,
    ca.SX,
)
"""All of them hold 0.5 and 2 exactly."""
PLAIN = KINDS[:-2]
"""Those of Python and NumPy."""
WHOLE: tuple[Callable[[int], Any], ...] = (int, np.int64, np.uint8, np.int16, float, np.array)
ROWS: tuple[Callable[[list[float]], Any], ...] = (
    list,
    tuple,
    np.array,
    lambda x: np.array(x, np.float32),
    ca.DM,
)


def test_every_kind_of_number_gives_the_same_run() -> None:
    model = sf.rabinowicz(sf.BrownMcPhee(), free=["mu_d"])
    expected = sf.simulate(model, 0.5, x0={"v": 0.5}, p={"mu_d": 0.125}, backend="vm").final
    for kind in KINDS:
        run = sf.simulate(
            model,
            kind(0.5),
            t_start=kind(0.0),
            x0={"v": kind(0.5)},
            p={"mu_d": kind(0.125)},
            event_tolerance=kind(0.5),
            samples=WHOLE[0](3),
            backend="vm",
        )
        assert run.final == expected
        assert run.at(kind(0.25)).keys() == expected.keys()
    for whole in WHOLE:
        run = sf.simulate(model, 0.5, samples=whole(3), max_steps=whole(200), backend="vm")
        assert run.t.size == 3
    for rows in ROWS:
        run = sf.simulate(model, 0.5, t_eval=rows([0.0, 0.25, 0.5]), backend="vm")
        assert run.t.tolist() == [0.0, 0.25, 0.5]
        assert run.at(rows([0.25]))["v"].shape == (1,)


def test_every_kind_of_number_is_a_parameter_an_input_and_a_sample() -> None:
    for kind in KINDS:
        law = sf.BrownMcPhee(mu_s=kind(0.5), v_t=kind(0.5))
        model = sf.drive(law, m=kind(2.0))
        run = sf.simulate(model, 0.01, u={"force": kind(2.0)}, backend="vm", samples=2)
        assert run["force"].tolist() == [2.0, 2.0]
        constant = sf.simulate(model, 0.01, u={"force": lambda t, k=kind: k(2.0)}, backend="vm")
        assert constant.final == run.final
        variable = sf.Variable("x", "m", start=kind(0.5), nominal=kind(2.0), lower=kind(0.0))
        outputs = {"y": sf.Output(kind(0.5), "m")}
        plain = sf.Model("m", x=(variable,), ode=-variable.symbol, outputs=outputs)
        assert plain.initial_state() == [0.5]
        assert float(sf.with_values(law, {"mu_d": kind(0.125)}).mu_d) == 0.125
    for rows in ROWS:
        held = sf.Hold(rows([0.0, 0.5]), rows([2.0, 2.0]))
        run = sf.simulate(sf.drive(sf.Viscous()), 0.5, u={"force": held}, backend="vm", samples=2)
        assert run["force"].tolist() == [2.0, 2.0]


def test_every_kind_of_number_makes_an_ensemble_and_a_flow() -> None:
    model = sf.drive(sf.Viscous(), free=["m"])
    for kind in PLAIN:
        found = sf.simulate_many(
            model, kind(0.5), x0={"v": kind(0.5)}, p={"m": kind(2.0)}, backend="vm",
            executor="serial", chunk=np.int64(1),
        )  # fmt: skip
        assert found["v"].shape == (1, 1)
    for rows in ROWS[:-1]:
        found = sf.simulate_many(model, 0.5, p={"m": rows([0.5, 2.0])}, executor="serial")
        assert found["v"].shape == (2, 1)
    for whole in WHOLE:
        assert sf.flow(model, steps=whole(2)).size1_out(0) == 2


def test_every_kind_of_number_describes_a_machine() -> None:
    energy = set[float]()
    for kind in PLAIN:
        m = mb.Mechanism("m", gravity=(kind(0.0), kind(0.0), kind(-8.0)))
        m.body("bob", mass=kind(0.5), inertia=(kind(0.5),) * 3, com=(kind(0.0),) * 3)
        m.frame("bob.pivot", at=(kind(0.0), kind(0.0), kind(0.5)))
        friction = mb.JointFriction(sf.Coulomb(), radius=kind(0.5), normal=kind(2.0), eps=kind(0.5))
        m.joint(mb.Revolute("hinge", "ground", "bob.pivot", start=kind(0.5), friction=friction))
        m.force(mb.JointSpringDamper("turning", "hinge", stiffness=kind(0.5), damping=kind(0.5)))
        m.force(mb.SpringDamper("spring", "ground", "bob", stiffness=kind(0.5)))
        run = sf.simulate(m.build(), 0.01, backend="vm", samples=2)
        energy.add(round(run.final["energy"], 12))
        urdf = '<robot name="r"><link name="a"/><link name="b"><inertial><mass value="1"/><inertia'
        urdf += ' ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link><joint name='
        urdf += '"j" type="continuous"><parent link="a"/><child link="b"/></joint></robot>'
        assert mb.read_urdf(urdf, level=kind(0.5)).build().x
    assert len(energy) == 1


def test_every_kind_of_number_is_taken_by_the_tools() -> None:
    model = sf.drive(sf.BrownMcPhee())
    data = synthetic_drive_data(speeds=(0.01, 0.05))
    t = np.linspace(0.0, 0.05, 60)
    belt = sf.rabinowicz(sf.BrownMcPhee(), free=["mu_d"])
    truth = sf.simulate(belt, 0.05, t_eval=t, x0={"v": 0.5})
    for kind in PLAIN:
        problem = ocp.rest_to_rest(model, kind(0.5), kind(2.0), limit=kind(16.0))
        assert problem.spans[0].boxes["force"] == (-16.0, 16.0)
        assert ocp.Free(kind(0.5), kind(2.0)).start == 1.0
        assert (kind(0.5) if kind is float else 0.5) * ocp.TIME
        assert ocp.TIME * kind(0.5)
        assert float(law_block(sf.LuGre(), h=kind(0.5)).constants["h"]) == 0.5
        assert float(plant_block(model, h=kind(0.5)).constants["h"]) == 0.5
        assert compare([sf.Coulomb()], N=kind(2.0)).curves
    for kind in KINDS[:2]:
        held = {"normal_force": kind(2.0), "fixed": {"offset": kind(0.0)}}
        assert Fit(InverseDynamics(), "coulomb+viscous", data, **held).solve().status.ok
        rows = Dataset.of(t=kind_of(kind, t), x=kind_of(kind, truth["x"]), units="m")
        fit = Fit(Shooting(x0={"v": kind(0.5)}), belt, rows).solve()
        assert fit.values["mu_d"] == pytest.approx(0.1, rel=1e-3)


def kind_of(kind: Callable[[float], Any], t: Any) -> Any:
    return list(map(kind, t.tolist())) if kind is float else t
