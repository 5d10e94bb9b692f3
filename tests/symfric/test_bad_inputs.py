"""Bad Python input: every public function refuses it in one sentence.

The table entry_points.toml lists functions and their bad values. The functions of this file give
the names in its expressions, and functions that follow from fields, such as all laws.

Valid input: every public function accepts the number types of Python, NumPy and CasADi.

Messages for the most frequent mistakes name the correct call.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import fields
from functools import partial
from pathlib import Path
from typing import Any

import bad_values as bad
import casadi as ca
import numpy as np
import pytest
from bad_values import INF, NAN, EntryPoint, Thing, entry_point, entry_points_refuse
from refusing import not_refused
from tables import table

import ocp
import symfric as sf
from identification import Dataset, Fit, InverseDynamics, Shooting, synthetic_drive_data
from symfric import compensation, figures
from symfric import multibody as mb
from symfric.codegen import law_block, plant_block
from symfric.figures import compare
from symfric.laws import BrownMcPhee, Coulomb, LuGre, Stribeck
from symfric.laws.catalogue import ALL_LAWS, POPULATIONS, WRAPPERS
from symfric.model import Model
from symfric.multibody import Mechanism
from symfric.scenes import ALL_SCENES, Rabinowicz

TABLE = table(__file__, "entry_points")


def belt() -> Model:
    return sf.rabinowicz(BrownMcPhee(), free=["mu_d"])


def listed(group: str, **names: Any) -> Iterator[EntryPoint]:
    """Yield the functions of a group of the table; all its expressions know the names here."""
    return bad.listed(TABLE[group], globals() | names)


def some_parameter(*more: Any) -> list[Any]:
    """A few values that are no parameter; all fields of laws and scenes share their checks."""
    return [None, "0.1", NAN, *more]


def entry_points_of_simulation() -> Iterator[EntryPoint]:
    def members(name: str) -> list[Any]:
        """As `values`, where arrays are good."""
        numbers = [
            x for x in bad.values(name) if not (isinstance(x, dict) and np.ndim(x.get(name)))
        ]
        rows = ([0.1, NAN], [], [[0.1]], ["a"], [None], [True, False], [1j])
        return numbers + [{name: row} for row in rows]

    functions = (
        *(lambda: 1.0, lambda t: "a", lambda t: None, lambda t: ca.vertcat(t, t), sf.Hold),
        *(lambda t: __import__("math").sin(t), lambda t: 1.0 if t > 0 else 0.0, lambda t: NAN),
        *(lambda t: ca.SX.sym("a"), lambda t: ca.MX.sym("a"), lambda t: [1.0, 2.0]),
        *(lambda t: 1j, lambda t: 1 / 0),
    )
    quick = {"t_end": 0.01, "backend": "vm"}
    yield from listed(
        "simulation", quick=quick, model=belt(), driven=sf.drive(BrownMcPhee()), members=members,
        functions=functions,
    )  # fmt: skip
    rows = [3.0, None, "ab", [NAN], [INF], [[0.0]], {}, Thing(), 1j, [None], ["a"], True]
    for kind in (sf.Hold, sf.Linear):
        yield entry_point(
            kind, {"t": [0.0], "values": [1.0]}, t=[*rows, [], [0.0, 1.0]],
            values=[*(row for row in rows if row != [[0.0]]), [], [0.0, 1.0]],
        )  # fmt: skip
        unordered = [[0.0, 0.0], [1.0, 0.0], [0.0, NAN]]
        yield entry_point(kind, {"t": [0.0, 1.0], "values": [1.0, 2.0]}, t=unordered)


def entry_points_of_a_trajectory() -> Iterator[EntryPoint]:
    run = sf.simulate(belt(), 0.01, backend="vm", samples=5, sensitivities=["mu_d"])
    unordered = ([], [0.01, 0.005], [0.0, 0.0])  # fine here
    inside = [x for x in bad.times([0.02], [-1.0], NAN, INF)[1:] if x not in unordered]
    return listed("trajectory", run=run, inside=inside)


def entry_points_of_models() -> Iterator[EntryPoint]:
    x = sf.Variable("x", "m")
    return listed(
        "models", x=x, good={"name": "m", "x": (x,), "ode": -x.symbol},
        collection=[3, "x", (3,), Thing(), (x,)], model=belt(),
    )  # fmt: skip


def entry_points_of_laws() -> Iterator[EntryPoint]:
    for kind in (ALL_LAWS | POPULATIONS).values():
        wrong, every = dict[str, list[Any]](), bad.parameter if kind is LuGre else some_parameter
        for item in fields(kind):
            if "unit" in item.metadata:
                more = [item.metadata["lower"] - 1.0, item.metadata["upper"] + 1.0]
                wrong[item.name] = every(*(x for x in more if abs(x) < INF))
            elif "choices" in item.metadata:
                wrong[item.name] = bad.choice()
        yield entry_point(kind, **wrong)
    for name, wrapper in WRAPPERS.items():
        yield entry_point(wrapper, {"law": Stribeck()}, name, law=bad.thing(Coulomb))
    rows = [None, 3.0, "ab", [], [0.0], [0.0, NAN], [[0.0, 1.0]], {}, Thing(), [1j, 2], ["a", "b"]]
    yield from listed("laws", rows=rows)


def entry_points_of_scenes() -> Iterator[EntryPoint]:
    for name, kind in ALL_SCENES.items():
        every = bad.parameter if kind is Rabinowicz else some_parameter
        wrong = {"law": bad.thing(BrownMcPhee, "lugre", belt())}
        for item in fields(kind):
            if "unit" in item.metadata:
                low = item.metadata["lower"]
                wrong[item.name] = every(*([low - 1.0] if low > -INF else []))
        yield entry_point(kind, {"law": BrownMcPhee()}, name, **wrong)
    yield from listed("scenes")


def entry_points_of_figures() -> Iterator[EntryPoint]:
    for name, make in figures.FIGURES.items():
        law, load = bad.thing(LuGre), bad.number(0.0, -1.0)
        yield entry_point(make, {"law": LuGre()}, name, law=law, N=load)
    yield from listed("figures", data=figures.compare([Coulomb()]))


URDF = """<robot name="r"><link name="a"/><link name="b"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/></joint></robot>"""


def pendulum(**changes: Any) -> Any:
    """A pendulum built with something else in one place."""
    given = {"name": "m", "gravity": (0, 0, -9.81)} | changes
    m = mb.Mechanism(given["name"], given["gravity"])
    body = {"name": "bob", "mass": 1.0, "inertia": (0.01, 0.01, 0.01), "com": (0.0, 0.0, 0.0)}
    m.body(**body | changes.get("body", {}))
    m.frame("ground.pivot", z=(0, 1, 0))
    m.frame(**{"place": "bob.pivot", "at": (0, 0, 0.5), "z": (0, 1, 0)} | changes.get("frame", {}))
    kind: Callable[..., Any] = changes.get("kind", mb.Revolute)
    hinge = {"name": "hinge", "parent": "ground.pivot", "child": "bob.pivot", "start": 0.3}
    m.joint(kind(**hinge | changes.get("joint", {})))
    if "part" in changes:
        m.joint(changes["part"])
    if "force" in changes:
        m.force(changes["force"]())
    if "constraint" in changes:
        m.constraint(changes["constraint"]())
    if "input" in changes:
        m.input(**{"name": "tau", "unit": "N m"} | changes["input"])
    return m.build(**changes.get("build", {}))


def part(place: str, more: Callable[..., Any] | None = None, **fixed: Any) -> Callable[..., Any]:
    """Return a function that builds the pendulum with its arguments in `place`."""

    def call(**wrong: Any) -> Any:
        return pendulum(**fixed, **{place: wrong if more is None else partial(more, **wrong)})

    return call


def entry_points_of_mechanisms() -> Iterator[EntryPoint]:
    wrong = [x for x in bad.parameter() if x is not None]
    motions = [None, "x", Thing(), lambda: 1, lambda t: None, lambda t: "a", lambda t: 1j]
    motions += [lambda t: ca.SX.sym("a"), lambda t: ca.vertcat(t, t), lambda t: NAN]
    return listed("mechanisms", rows=bad.vectors(), motions=motions, wrong=wrong)


def entry_points_of_control() -> Iterator[EntryPoint]:
    model = sf.drive(BrownMcPhee(), free=["m"])
    effort = ocp.integral(lambda s: s.force**2)
    ends = {"start": {"x": 0.0, "v": 0.0}, "end": {"x": 0.1, "v": 0.0}}
    good = {"model": model, "T": 1.0, "cost": effort, **ends}

    def moved(model: sf.Model, T: float, cost: ocp.Cost, **more: Any) -> ocp.Problem:
        return ocp.Problem(ocp.Phase(model, T, **more), cost)

    wrong = (None, "1", NAN, INF, [0.0, 1.0, 2.0], (1.0, 0.0), (0.0,), (NAN, 1.0), True, 1j)
    ranges = [3, "x", [("x", 1)], Thing(), {"nonsense": 1.0}, {3: 1.0}, True]
    ranges += bad.each("x", *wrong, (0.0, "a"), Thing())
    costs = (
        *(lambda s: s.nonsense, lambda s: "a", lambda s: None, lambda s: s.t * 0, lambda: 1),
        *(lambda s: ca.vertcat(s.x, s.x), lambda s: NAN, lambda s: ca.SX.sym("a")),
        lambda s: ca.MX.sym("a"),
    )
    fast = {"problem": moved(**good), "intervals": 4, "friction": "smooth", "verify": False}
    fast |= {"solver": ocp.Ipopt(max_iter=1), "throw": False}
    meshes = ([], [0.0], [0.0, 0.5], [0.0, 0.5, 0.5, 1.0], [0.0, NAN, 1.0])
    guesses = ("a", NAN, [[1.0]], [], lambda: 1, lambda t: "a", lambda t: [1.0, 2.0], None, 1j)
    return listed(
        "control", model=model, good=good, moved=moved, ranges=ranges, costs=costs, fast=fast,
        meshes=meshes, guesses=guesses,
    )  # fmt: skip


test_every_entry_point_refuses_bad_input_in_a_sentence = entry_points_refuse(
    {
        "simulation": entry_points_of_simulation,
        "trajectory": entry_points_of_a_trajectory,
        "models": entry_points_of_models,
        "laws": entry_points_of_laws,
        "scenes": entry_points_of_scenes,
        "figures": entry_points_of_figures,
        "mechanisms": entry_points_of_mechanisms,
        "control": entry_points_of_control,
        "code": lambda: listed("code"),
    }
)


KINDS: tuple[Callable[[float], Any], ...] = (
    *(float, np.float32, np.float64, np.float16, np.array, lambda x: np.array(x, np.float32)),
    *(ca.DM, ca.SX),
)
"""All of them hold 0.5 and 2 exactly."""
PLAIN = KINDS[:-2]
"""Those of Python and NumPy."""
WHOLE: tuple[Callable[[int], Any], ...] = (int, np.int64, np.uint8, np.int16, float, np.array)
ROWS: tuple[Callable[[list[float]], Any], ...] = (
    *(list, tuple, np.array, lambda x: np.array(x, np.float32), ca.DM),
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
    data = synthetic_drive_data(speeds=(0.01, 0.05), rate=250.0)
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


def test_messages_name_the_correct_call() -> None:
    law = sf.BrownMcPhee()
    names = {"BELT": sf.rabinowicz(law), "DRIVEN": sf.drive(law), "Rabinowicz": Rabinowicz}
    table = Path(__file__).with_name("stumbles.toml")
    assert not_refused(table, sf=sf, math=math, Mechanism=Mechanism, **names) == []


def test_compensation_and_drives_refuse_bad_input() -> None:
    law, noisy = LuGre(mu_s=6.0, mu_d=4.0), {"mass": 1.0, "noise": 1e-4}
    plant = sf.drive(law, m=1.0, N=1.0, free=["mu_d"])
    names = {
        "BRISTLES": law, "NOISY": noisy, "ROW": np.ones(10), "DRIVEN": sf.drive(LuGre()),
        "ESTIMATOR": compensation.recursive_estimator(law, **noisy, h=1e-3),
        "LOOP": (plant, compensation.sine(0.02, 0.5, 0.1), compensation.compensator(law)),
        "AXIS": sf.Drive(torque_constant=0.12, gear_ratio=-2, lead=5e-3),
    }  # fmt: skip
    table = Path(__file__).with_name("refusals.toml")
    assert not_refused(table, compensation, sf=sf, math=math, **names) == []
