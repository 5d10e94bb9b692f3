"""Robots of others (PyPI's example-robot-data): as Pinocchio has them, and they move.

Guards rows 20 to 23 of the campaign: axes of zeros, inertias that are not quite physical, mass
matrices with zeros on one side, massless links that joints move.
"""

import re
import warnings
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from symfric import simulate
from symfric.multibody import functions
from symfric.multibody.urdf import read_urdf

pin: Any = pytest.importorskip("pinocchio", reason="needs Pinocchio (extra pinocchio)")
Array = NDArray[np.float64]
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
