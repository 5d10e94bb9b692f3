"""Random and published robots compared with Pinocchio: dynamics, frames, energies, motion."""

import re
import warnings
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from robots import MOVING, random_robot, rod

from symfric import Coulomb, Law, simulate
from symfric.foundation.numeric import Array
from symfric.multibody import Mechanism, functions
from symfric.multibody.spatial import euler_g, rotation
from symfric.multibody.urdf import read_urdf
from symfric.multibody.urdf_file import parse

pin: Any = pytest.importorskip("pinocchio", reason="needs Pinocchio (extra pinocchio)")
LIMIT = '<limit lower="-9" upper="9" effort="9" velocity="9"/></joint>'
EASY = Coulomb(mu_d=1.0, v_eps=0.1)
each_robot = pytest.mark.parametrize("seed", range(6))
each_gravity = pytest.mark.parametrize("g", [9.81, 0.0])


@dataclass(frozen=True)
class Twin:
    """A robot here and in Pinocchio, in one random state; `rows` are its velocities there."""

    model: Any
    data: Any
    mechanism: Mechanism
    names: list[str]
    rows: list[int]
    q: Array
    qd: Array
    q_there: Array
    qd_there: Array


def place(model: Any, name: str, angle: float, rate: float, q: Array, qd: Array) -> int:
    """Put angle and rate of a joint of one coordinate into q and qd of Pinocchio."""
    joint = model.joints[model.getJointId(name)]
    at = slice(joint.idx_q, joint.idx_q + joint.nq)
    q[at] = angle if joint.nq == 1 else (np.cos(angle), np.sin(angle))
    qd[joint.idx_v] = rate
    return joint.idx_v


def twin(text: str, seed: int, g: float = 9.81, law: Law | None = None) -> Twin:
    model = pin.buildModelFromXML(text.replace("</joint>", LIMIT))  # it demands limits
    model.gravity.linear = np.array([0.0, 0.0, -g])
    mechanism = read_urdf(text, law=law, gravity=(0.0, 0.0, -g))
    names = [v.name for v in mechanism.prepare().q]
    q, qd = np.random.default_rng(seed + 1000).normal(size=(2, len(names)))
    q_there, qd_there = np.zeros(model.nq), np.zeros(model.nv)
    moved = zip(names, q, qd, strict=True)
    rows = [place(model, *each, q_there, qd_there) for each in moved]
    return Twin(model, model.createData(), mechanism, names, rows, q, qd, q_there, qd_there)


def robot(seed: int) -> str:
    return random_robot(seed, n=3 + seed % 10)


def close(found: Array, expected: Array) -> bool:
    return bool(np.abs(found - expected).max() <= 1e-10 * np.abs(expected).max())


def friction(text: str, t: Twin) -> Array:
    """Damping and Coulomb friction of every joint, in closed form."""
    tags = {joint.name: joint for joint in parse(text).joints}
    levels = [(tags[name].damping, tags[name].friction) for name in t.names]
    return np.array([d * w + f * np.tanh(w / 0.1) for (d, f), w in zip(levels, t.qd, strict=True)])


@each_robot
@each_gravity
def test_dynamics_are_those_of_pinocchio_with_friction(seed: int, g: float) -> None:
    """Mass matrix, bias, inverse and forward dynamics."""
    text = robot(seed)
    t = twin(text, seed, g, law=EASY)
    there, rows, f = (t.model, t.data, t.q_there), t.rows, functions(t.mechanism)
    M = pin.crba(*there)
    M = np.triu(M) + np.triu(M, 1).T
    assert close(f["mass"](t.q, []).full(), M[np.ix_(rows, rows)])
    still = np.zeros(len(t.mechanism.inputs))
    bias = pin.nonLinearEffects(*there, t.qd_there)[rows]
    found = f["bias"](t.q, t.qd, still, []).full().ravel()
    assert np.abs(found - bias).max() <= 1e-10 * max(1.0, np.abs(bias).max())
    a, torque = np.random.default_rng(seed).normal(size=(2, t.q.size))
    a_there, torque_there = np.zeros((2, t.model.nv))
    a_there[rows], torque_there[rows] = a, torque - friction(text, t)
    found = f["inverse_dynamics"](t.q, t.qd, a, [], [], still, []).full().ravel()
    assert close(found, pin.rnea(*there, t.qd_there, a_there)[rows] + friction(text, t))
    model, u = t.mechanism.build(), dict(zip(t.names, torque, strict=True))
    inputs = [u[v.name.removeprefix("tau_")] for v in model.u]
    found = model.function("ode")(0, np.hstack([t.q, t.qd]), [], inputs, []).full().ravel()
    assert len(model.z) == 0
    assert close(found[t.q.size :], pin.aba(*there, t.qd_there, torque_there)[rows])


@each_robot
def test_every_link_is_where_pinocchio_puts_it(seed: int) -> None:
    text = robot(seed)
    t = twin(text, seed)
    pin.framesForwardKinematics(t.model, t.data, t.q_there)
    eq = t.mechanism.prepare().eq
    frames = {place.split(".")[-1]: (place, f) for place, f in t.mechanism.frames}
    for link in parse(text).links:
        place, frame = frames[link]
        motion = eq.kin.motion[place.partition(".")[0]]
        pose = ca.Function("pose", [eq.q], [motion.R @ frame.R, eq.kin.point(place)[0]])
        expected = t.data.oMf[t.model.getFrameId(link)]
        R, p = (x.full() for x in pose.call([t.q]))
        assert expected.rotation == pytest.approx(R, abs=1e-12), link
        assert expected.translation == pytest.approx(p.ravel(), abs=1e-12), link


def test_floating_joints_move_as_in_pinocchio() -> None:
    """Energies, and the accelerations of the joints that turn and slide."""
    text = random_robot(7, 5, ("floating", *MOVING))
    there = pin.buildModelFromXML(text.replace("</joint>", LIMIT))
    rng = np.random.default_rng(1)
    mechanism = read_urdf(text)
    made, f = mechanism.prepare(), functions(mechanism)
    q, qd = np.zeros(made.eq.n), np.zeros(made.eq.n)
    q_there, qd_there = pin.neutral(there), np.zeros(there.nv)
    columns = {v.name: i for i, v in enumerate(made.q)}
    rows = {}
    for joint in parse(text).joints:
        if joint.kind == "fixed":
            continue
        if joint.kind == "floating":
            j = there.joints[there.getJointId(joint.name)]
            at, at_v = j.idx_q, j.idx_v
            p, e, v, w = (rng.normal(size=n) for n in (3, 4, 3, 3))
            e /= np.linalg.norm(e)
            here = slice(columns[f"{joint.name}_x"], columns[f"{joint.name}_x"] + 7)
            R, G = (ca.DM(x(ca.SX(e))).full() for x in (rotation, euler_g))
            q[here] = [*p, *e]
            qd[here] = [*(R @ v), *(G.T @ w / 2)]
            q_there[at : at + 7] = [*p, *e[1:], e[0]]
            qd_there[at_v : at_v + 6] = [*v, *w]
            continue
        k, angle, rate = columns[joint.name], *rng.normal(size=2)
        q[k], qd[k] = angle, rate
        rows[k] = place(there, joint.name, angle, rate, q_there, qd_there)
    data = there.createData()
    kinetic, potential = (float(x) for x in f["energy"].call([q, qd, []]))
    assert kinetic == pytest.approx(pin.computeKineticEnergy(there, data, q_there, qd_there))
    assert potential == pytest.approx(pin.computePotentialEnergy(there, data, q_there))
    still = np.zeros(len(mechanism.inputs))
    M, b = f["mass"](q, []).full(), f["bias"](q, qd, still, []).full().ravel()
    J = f["constraints"].call([q, []])[1].full()
    m = J.shape[0]
    drift = [sum(qd[k] ** 2 for k in np.flatnonzero(row)) for row in J]
    matrix = np.block([[M, J.T], [J, np.zeros((m, m))]])
    a = np.linalg.solve(matrix, np.hstack([-b, -np.array(drift)]))
    expected = pin.aba(there, data, q_there, qd_there, np.zeros(there.nv))
    assert a[list(rows)] == pytest.approx(expected[list(rows.values())], rel=1e-10)


def test_planar_joint_has_the_energies_of_pinocchio() -> None:
    """With its axis along z: Pinocchio takes no other."""
    tag = '<dynamics damping="0.3" friction="0.2"/>'
    text = rod(
        **{"revolute": "planar", "0 1 0": "0 0 1", '"0 0 1"/>': '"0 0 1" rpy="3 2 1"/>', tag: ""}
    )
    there = pin.buildModelFromXML(text.replace("</joint>", LIMIT))
    c, s = np.cos(0.7), np.sin(0.7)
    q, v = np.array([0.3, -0.2, c, s]), np.array([0.5 * c + 0.4 * s, 0.4 * c - 0.5 * s, -0.9])
    kinetic = pin.computeKineticEnergy(there, there.createData(), q, v)
    potential = pin.computePotentialEnergy(there, there.createData(), q)
    found = functions(read_urdf(text))["energy"].call([[0.3, -0.2, 0.7], [0.5, 0.4, -0.9], []])
    assert [float(x) for x in found] == pytest.approx([kinetic, potential], rel=1e-12)


WITHOUT_A_MACHINE = ("quadrotor_base", "iris_simple", "ur3")
"""Single bodies that only `floating=True` moves, and a file without a link."""
FEW = ("TwoDofs", "finger_edu", "so101")


def files() -> list[Path]:
    try:
        found = distribution("example-robot-data")
    except PackageNotFoundError:
        pytest.skip("needs example-robot-data (extra urdf-check)")
    share = Path(str(found.locate_file("cmeel.prefix/share/example-robot-data/robots")))
    return sorted(share.rglob("*.urdf"))


def without_friction(path: Path) -> str:
    text = path.read_text(encoding="utf-8", errors="replace")
    return re.sub(r"<dynamics[^>]*?/>|<\?xml[^>]*\?>", "", text)


def away(found: Array, expected: Array) -> float:
    """Largest difference, relative to the largest entry."""
    return float(np.abs(found - expected).max() / max(np.abs(expected).max(), 1e-9))


def differences(path: Path) -> list[float]:
    """Mass matrix, gravity and inverse dynamics against Pinocchio, at random positions."""
    mechanism = read_urdf(without_friction(path))
    model = pin.buildModelFromUrdf(str(path))
    data, q_there = model.createData(), pin.neutral(model)
    index = {re.sub(r"\W", "_", n, flags=re.ASCII): i for i, n in enumerate(model.names) if i}
    names = [v.name for v in mechanism.prepare().q]
    joints = [model.joints[index[name]] for name in names]
    q, v, a = np.random.default_rng(1).uniform(-1, 1, (3, len(names)))
    v_there, a_there = np.zeros((2, model.nv))
    rows = [joint.idx_v for joint in joints]
    v_there[rows], a_there[rows] = v, a
    for joint, angle in zip(joints, q, strict=True):
        at = slice(joint.idx_q, joint.idx_q + joint.nq)
        q_there[at] = angle if joint.nq == 1 else (np.cos(angle), np.sin(angle))
    f, still, u = functions(mechanism), np.zeros(len(names)), np.zeros(len(mechanism.inputs))
    M = pin.crba(model, data, q_there)
    M = np.triu(M) + np.triu(M, 1).T
    # what is held at zero moves no mass
    assert not np.delete(M, rows, axis=0).any()
    gravity = pin.computeGeneralizedGravity(model, data, q_there)[rows]
    forces = pin.rnea(model, data, q_there, v_there, a_there)[rows]
    multipliers = np.zeros(f["inverse_dynamics"].size1_in(3))
    return [
        away(f["mass"](q, []).full(), M[np.ix_(rows, rows)]),
        away(f["bias"](q, still, u, []).full().ravel(), gravity),
        away(f["inverse_dynamics"](q, v, a, multipliers, [], u, []).full().ravel(), forces),
    ]


def gain(path: Path) -> float:
    """Energy gained in 0.1 s without motors, relative to the largest kinetic energy."""
    run = simulate(read_urdf(path).build(), 0.1, backend="vm", samples=11)
    energy = run["energy"] - run["energy"][0]
    return float(energy.max() / max(run["kinetic"].max(), 1e-9))


def check(paths: list[Path]) -> None:
    wrong: dict[str, object] = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # limits are left out, doubts are taken as they are
        for path in paths:
            found = [*differences(path), gain(path)]
            if max(found[:3]) > 1e-12 or found[3] > 1e-5:
                wrong[path.name] = found
    assert not wrong


def test_a_few_are_those_of_pinocchio_and_move() -> None:
    check([path for path in files() if path.stem in FEW])


@pytest.mark.slow
def test_all_are_those_of_pinocchio_and_move() -> None:
    every = files()
    assert len(every) >= 69
    check([path for path in every if path.stem not in WITHOUT_A_MACHINE])


def test_what_holds_no_machine_is_refused_in_a_sentence() -> None:
    for path in files():
        if path.stem in WITHOUT_A_MACHINE:
            with (
                warnings.catch_warnings(),
                pytest.raises(ValueError, match=r"expected (bodies that can move|at least one)"),
            ):
                warnings.simplefilter("ignore")
                read_urdf(path).build()
