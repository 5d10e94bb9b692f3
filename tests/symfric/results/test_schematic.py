"""Schematics: legible, complete, and with arrows in the positive directions."""

from dataclasses import replace
from itertools import combinations
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from symfric import BrownMcPhee, Model, Variable
from symfric.foundation.variable import starts_of, symbols_of
from symfric.model.kinds import POSITION
from symfric.multibody import (
    BandBrake,
    Belt,
    Cam,
    CapstanDrum,
    Cylindrical,
    DiscClutch,
    DrumBrake,
    Force,
    Gear,
    Gravity,
    JointFriction,
    JointSpringDamper,
    JointStop,
    Mechanism,
    PrescribedMotion,
    Prismatic,
    Revolute,
    Rolling,
    Screw,
    SpringDamper,
    UserConstraint,
    UserForce,
)
from symfric.multibody.forces import Part
from symfric.results.schematic import formula, schematic
from symfric.scenes import ALL_SCENES, MECHANISMS, DrillString, Drive, FourBar, Rabinowicz

LAW = BrownMcPhee()


def texts(figure: Figure) -> list[str]:
    return [text.get_text() for text in figure.axes[0].texts if text.get_text()]


def check_legible(figure: Figure) -> None:
    """No text covers another one or leaves the figure, at the width of a column."""
    figure.draw_without_rendering()
    assert figure.get_figwidth() * 25.4 == pytest.approx(85.0)
    written = [text for text in figure.axes[0].texts if text.get_text()]
    assert min(text.get_fontsize() for text in written) >= 6.0
    boxes = [text.get_window_extent() for text in written]
    assert [(a, b) for a, b in combinations(range(len(boxes)), 2)
            if boxes[a].overlaps(boxes[b])] == []  # fmt: skip
    for box in boxes:
        assert figure.bbox.contains(*box.min)
        assert figure.bbox.contains(*box.max)


def chain(n: int) -> Mechanism:
    m = Mechanism("chain")
    m.frame("ground.far", z=(0.0, 1.0, 0.0))
    before = "ground"
    for i in range(1, n + 1):
        m.body(f"link_{i}", 1.0, (0.01, 0.01, 0.01), com=(0.0, 0.0, -0.1))
        m.frame(f"link_{i}.near", z=(0.0, 1.0, 0.0))
        m.frame(f"link_{i}.far", at=(0.0, 0.0, -0.2), z=(0.0, 1.0, 0.0))
        friction = JointFriction(LAW, radius=0.01)
        ends = f"{before}.far", f"link_{i}.near"
        m.joint(Revolute(f"q_{i}", *ends, 0.3, friction=friction))
        before = f"link_{i}"
    m.frame("ground.wall", at=(1.0, 0.0, 0.0))
    m.force(SpringDamper("tie", "ground.wall", before, stiffness=20.0, damping=0.5))
    return m


FULL = ("arm", "four_mass", "drill_string", "nip", "quarter_car")
"""Scenes with many labels; the suite draws these."""


@pytest.mark.parametrize(
    "name", [n if n in FULL else pytest.param(n, marks=pytest.mark.slow) for n in ALL_SCENES]
)
def test_schematics_of_all_scenes_are_legible_and_name_what_is_in_them(name: str) -> None:
    machine = ALL_SCENES[name](LAW)
    figure, model = machine.schematic(), machine.model()
    check_legible(figure)
    found = texts(figure)
    for contact in model.contacts:
        assert [text for text in found if text.startswith(f"{contact.name}: $N$")]
    for u in model.u:
        assert [text for text in found if formula(u.name) in text.split(", ")]
    for v in model.x:
        if v.kind == POSITION:
            assert [text for text in found if formula(v.name) in text.split(", ")]


def test_symbols_stand_at_their_elements() -> None:
    assert set(texts(Rabinowicz(LAW).schematic())) == {
        "$x$", "$z$", "block, $m$", "belt: $N$ = $m$ $g$", "$k$", "$x$, $v$",
        r"$v_{\mathrm{belt}}$",
    }  # fmt: skip
    assert {"link_2, 1 kg", "q_2: $N$", r"$q_{2}$, $\dot{q}_{2}$", "20 N/m, 0.5 N s/m"} <= set(
        texts(chain(2).schematic())
    )


def test_belts_and_springs_of_joints_are_drawn_between_their_joints() -> None:
    m = Mechanism("belt_drive")
    torque = m.input("tau", "N m")
    for k in (1, 2):
        m.body(f"pulley_{k}", 1.0, (0.01, 0.01, 0.01))
        m.frame(f"pulley_{k}.axle", z=(0.0, 1.0, 0.0))
        m.frame(f"ground.axle_{k}", at=(0.5 * k, 0.0, 0.0), z=(0.0, 1.0, 0.0))
        m.joint(Revolute(f"q_{k}", f"ground.axle_{k}", f"pulley_{k}.axle"))
    m.force(Belt("belt", "q_1", "q_2", LAW, 50.0, 0.1, 0.2, 3.0))
    m.force(JointSpringDamper("motor", "q_1", actuator=torque))
    m.force(JointSpringDamper("load", "q_2", stiffness=30.0, damping=2.0))
    figure = m.schematic()
    check_legible(figure)
    found = {"belt: $N$", r"$\tau$", "30 N m/rad, 2 N m s/rad", "pulley_1, 1 kg"}
    assert found <= set(texts(figure))
    marks = {mark.name: mark for mark in m.build().sketch().marks}
    assert (marks["belt"].symbol.line, marks["load"].symbol.line) == ("link", "spiral")
    assert (marks["belt"].a, marks["belt"].b) == (marks["q_1"].b, marks["q_2"].b)


ELEMENTS = (
    Belt("part", "q_1", "q_2", LAW, 50.0, 0.1, 0.2, 3.0),
    BandBrake("part", "q_1", LAW, 50.0, 0.1, 3.0, 0.3, 0.1),
    CapstanDrum("part", "rail", LAW, 50.0, 0.1, 3.0, drum="q_1"),
    DiscClutch("part", "q_1", LAW, 50.0, 0.2, 0.1, b="q_2"),
    DrumBrake("part", "q_1", LAW, 50.0, 0.1, 0.2, 0.1, 0.05),
    Cam("part", "q_1", "rail", lambda angle: 0.1 * ca.sin(angle)),
    Gear("part", "q_1", "q_2", -0.5),
    JointSpringDamper("part", "q_1", actuator=2.0),
    JointStop("part", "rail", -1.0, 1.0, 1e3),
    PrescribedMotion("part", "q_2", lambda t: t**2),
    Rolling("part", "q_2", "rail", 0.1),
    Screw("part", "thread", 0.01),
    SpringDamper("part", "ground.axle_2", "cart", actuator=2.0),
    UserConstraint("part", lambda kin: kin.along("rail")[0] - kin.along("q_1")[0]),
    UserForce("part", "cart.hook", lambda _: ((1.0, 0.0, 0.0), (0.0, 0.0, 0.0))),
)


def concrete(kind: type) -> set[type]:
    return {kind, *(below for one in kind.__subclasses__() for below in concrete(one))}


@pytest.mark.parametrize("parts", [ELEMENTS[:5], ELEMENTS[5:10], ELEMENTS[10:]])
def test_every_element_is_named(parts: tuple[Part, ...]) -> None:
    m = Mechanism("machine")
    for k in (1, 2):
        m.body(f"pulley_{k}", 1.0, (0.01, 0.01, 0.01))
        m.frame(f"pulley_{k}.axle", z=(0.0, 1.0, 0.0))
        m.frame(f"ground.axle_{k}", at=(0.5 * k, 0.0, 0.0), z=(0.0, 1.0, 0.0))
        m.joint(Revolute(f"q_{k}", f"ground.axle_{k}", f"pulley_{k}.axle"))
    for name, joint in (("cart", Prismatic("rail", "ground", "cart")),
                        ("nut", Cylindrical("thread", "ground.axle_1", "nut"))):  # fmt: skip
        m.body(name, 1.0, (0.01, 0.01, 0.01))
        m.joint(joint)
    m.frame("cart.hook", at=(0.1, 0.0, 0.0))
    names = [f"part_{k}" for k in range(len(parts))]
    for name, part in zip(names, parts, strict=True):
        (m.force if isinstance(part, Force) else m.constraint)(replace(part, name=name))
    figure = m.schematic()
    check_legible(figure)
    for name in map(formula, names):
        found = [text for text in texts(figure) if text.startswith(name)]
        assert found in ([name], [f"{name}: $N$"])


def test_no_element_is_missing_above() -> None:
    every = {kind for kind in concrete(Part) if getattr(kind, "__final__", False)}
    own = {kind for kind in every if kind.__module__.startswith("symfric.")}
    assert own == {type(part) for part in ELEMENTS} | {Gravity}


@pytest.mark.parametrize(
    "figure",
    [
        lambda: chain(2).schematic(),
        pytest.param(lambda: chain(16).schematic(), marks=pytest.mark.slow),
        lambda: DrillString(LAW, lumps=1).schematic(),
        pytest.param(lambda: DrillString(LAW, lumps=16).schematic(), marks=pytest.mark.slow),
        lambda: FourBar(LAW, crank=1.0, coupler=30.0, rocker=25.0, base=28.0).schematic(),
        lambda: Rabinowicz(LAW, k=1e6, m=0.01).schematic(),
        lambda: Drive(LAW, turning=True).schematic(),
    ],
)
def test_schematics_stay_legible_with_other_parameters(figure) -> None:
    check_legible(figure())


def test_labels_without_a_free_place_are_omitted(monkeypatch: pytest.MonkeyPatch) -> None:
    complete = chain(8).schematic()
    check_legible(complete)
    monkeypatch.setattr("symfric.results.schematic.ROOMS", ((20.0, 50.0),))
    crowded = chain(8).schematic()
    check_legible(crowded)
    assert set(texts(crowded)) < set(texts(complete))


@pytest.mark.parametrize("name", MECHANISMS)
def test_arrows_point_along_the_motion(name: str) -> None:
    """A step of each coordinate alone moves the place of its arrow along or about the axis."""
    model = MECHANISMS[name](LAW).model()
    sketch, every = model.sketch(), (*model.x, *model.z, *model.u)
    places = ca.Function("places", [symbols_of(every), model.t], [sketch.places])
    start, names = np.array(ca.DM(starts_of(every))), [v.name for v in every]
    for arrow in sketch.arrows:
        if arrow.names[0] not in names or arrow.names[0].startswith("tau"):
            continue
        step = np.zeros_like(start)
        step[names.index(arrow.names[0])] = 1e-6
        at = [np.array(places(start + s * step, 0.0)) for s in (-1, 1)]
        R, moved = (x.T.reshape(-1, 4, 3) for x in (at[0], (at[1] - at[0]) / 2e-6))
        axis = np.array(arrow.axis) @ R[arrow.frame, :3]
        if not arrow.turning:
            assert moved[arrow.at, 3] == pytest.approx(axis, abs=1e-6)
            continue
        for k in range(3):
            turned = np.cross(axis, R[arrow.at, k])
            assert moved[arrow.at, k] == pytest.approx(turned, abs=1e-5)


def test_a_schematic_is_written_and_a_model_without_places_is_refused(tmp_path: Path) -> None:
    Drive(LAW).schematic(tmp_path / "drive.png")
    with Image.open(tmp_path / "drive.png") as picture:
        assert picture.width == int(85 / 25.4 * 300)
    x = Variable("x", "m", start=1.0)
    with pytest.raises(ValueError, match=r"schematic of 'decay': expected a machine with places"):
        schematic(Model("decay", x=(x,), ode=-x.symbol))
