"""Mechanisms from URDF files against closed forms, and what the file says."""

import warnings
from itertools import product
from math import inf, pi

import casadi as ca
import numpy as np
import pytest
from robots import SMALL, rod
from scipy.optimize import brentq

from symfric import Coulomb, LimitWarning, LuGre, Sum, Viscous, parameters, simulate
from symfric.laws import Stribeck
from symfric.multibody import JointFriction, Mechanism, Universal, functions
from symfric.multibody.outlines import sphere
from symfric.multibody.urdf import holding, read_urdf, relative, tag_friction  # fmt: skip
from symfric.multibody.urdf_file import parse
from symfric.results.strokes import Poses, look, outlines, strokes


def test_damping_is_viscous_and_friction_a_constant_torque_without_any_unknown() -> None:
    model = read_urdf(SMALL).build()
    assert ([v.name for v in model.x], model.z) == (["hinge", "hinge_rate"], ())
    assert [(v.name, v.unit) for v in model.u] == [("tau_hinge", "N m")]
    inertia, weight = 0.1 + 2 * 0.25**2, 2 * 9.81 * 0.25
    f = model.function("ode")
    for rate, torque in ((0.5, 0.2 + 0.3 * 0.5), (-2.0, -0.2 - 0.3 * 2.0), (0.0, 0.0)):
        acceleration = float(f(0, [0.3, rate], [], [0.0], [])[1])
        assert acceleration == pytest.approx(-(weight * np.sin(0.3) + torque) / inertia, rel=1e-12)


def test_tags_of_zero_add_no_friction() -> None:
    old = 'damping="0.3" friction="0.2"'
    for damping, level, law in ((0.0, 0.0, None), (0.3, 0.0, Viscous), (0, 0.2, Coulomb)):
        text = rod(**{old: f'damping="{damping}" friction="{level}"'})
        friction = tag_friction(parse(text).joints[0])
        assert friction is None if law is None else isinstance(friction.law, law)  # type: ignore[union-attr]
    assert isinstance(tag_friction(parse(SMALL).joints[0]).law, Sum)  # type: ignore[union-attr]


def test_another_law_gets_the_friction_tag_as_its_normal_force() -> None:
    run = simulate(read_urdf(SMALL, law=relative(LuGre())).build(), 0.2, x0={"hinge": 1.2})
    assert "hinge_z" in run.units
    rate = run["hinge_rate"][-1]
    assert rate < -0.5
    # sliding at mu_d/mu_s = 1/1.5 of the level, and the damping of the file
    assert run["hinge_friction"][-1] == pytest.approx(0.3 * rate - 0.2 / 1.5, rel=1e-6)
    values = parameters(relative(Stribeck(mu_s=0.6, mu_d=0.15, sigma_2=0.7)))
    assert [values[n].value for n in ("mu_s", "mu_d", "sigma_2")] == [1.0, 0.25, 0.7]
    assert relative(viscous := Viscous()) is viscous
    with pytest.warns(
        UserWarning, match=r"LuGre has no effect, because .* or --friction-level 0.5"
    ):
        read_urdf(rod(**{' friction="0.2"': ""}), law=LuGre())


def test_bearings_replace_friction_of_the_file_by_friction_of_the_reactions() -> None:
    bearing = JointFriction(Coulomb(), radius=0.01)
    for text, name, known in ((SMALL, "elbow", "hinge"), (WELDED, "weld", "spin")):
        with pytest.raises(ValueError, match=f"bearings: expected one of {known}, got {name}"):
            read_urdf(text, bearings={name: bearing})
    model = read_urdf(SMALL, bearings={"hinge": bearing}).build()
    assert [v.name for v in model.z] == ["hinge_N"]
    weight = simulate(model, 1e-3, rtol=1e-8)["hinge_N"][0]
    assert weight == pytest.approx(2 * 9.81, rel=1e-4)


def weight(mass: float = 1, J: tuple[float, ...] = (1, 1, 1), at: str = "0 0 0") -> str:
    six = zip(("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), J, strict=False)
    entries = " ".join(f'{key}="{x}"' for key, x in six)
    return f'<inertial><origin xyz="{at}"/><mass value="{mass}"/><inertia {entries}/></inertial>'


def bar(name: str, inertial: str = "") -> str:
    return f'<link name="{name}">{inertial}</link>'


def hinge(
    name: str, parent: str, child: str, axis: str = "1 0 0", more: str = "",
    kind: str = "continuous",
) -> str:  # fmt: skip
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<axis xyz="{axis}"/>{more}</joint>'
    )


def text_of(*parts: str, name: str = "r") -> str:
    return f'<robot name="{name}">{bar("world")}{"".join(parts)}</robot>'


HEAVY = weight(2, (0.1, 0.2, 0.15, 0.01, 0.02, -0.03), "0.1 0.2 -0.5")
WELDED = text_of(
    bar("hub-0"), hinge("spin", "world", "left", "0 0 2"), bar("left", weight(1, (0.1, 0.2, 0.3))),
    hinge("weld", "left", "hub-0", "1 0 0", f'<origin xyz="1 0 0" rpy="0 0 {pi / 2}"/>', "fixed"),
    hinge("weld2", "hub-0", "right", "1 0 0", f'<origin xyz="0 2 0" rpy="{pi / 2} 0 0"/>', "fixed"),
    bar("right", weight(3, (0.1, 0.2, 0.3), "0 0.5 0")), name="dumb bell",
)  # fmt: skip


def test_links_held_by_fixed_joints_are_one_body() -> None:
    """Two bars turned against each other: parallel axes by hand."""
    with pytest.warns(UserWarning, match="names changed: link 'hub-0' to hub_0"):
        m = read_urdf(WELDED)
    _, body = m.bodies
    assert (m.name, body.name, body.mass) == ("dumb_bell", "left", 4.0)
    # right is at (-1, 0, 0), its y up and its x along y; its mass half a metre above
    assert body.com == pytest.approx((-0.75, 0.0, 0.375))
    d2, h2 = 3 / 4, 3 / 4 * 0.5**2
    expected = [0.1 + 0.3 + h2, 0.2 + 0.1 + d2 + h2, 0.3 + 0.2 + d2, 0.0, d2 * 0.5, 0.0]
    assert [float(x) for x in body.inertia] == pytest.approx(expected, abs=1e-12)
    places = {place: frame for place, frame in m.frames}
    assert ca.DM(places["left.right"].p).full().ravel() == pytest.approx([-1.0, 0.0, 0.0])
    # quarter turns leave zeros
    assert body.J.nnz() == 5
    assert functions(m)["mass"].n_instructions() <= 3


def test_massless_root_is_the_ground_and_a_heavy_one_may_float() -> None:
    assert [b.name for b in read_urdf(SMALL, floating=True).bodies] == ["ground", "arm"]
    heavy = rod(**{bar("world").replace("></link>", "/>"): bar("world", weight())})
    assert [b.name for b in read_urdf(heavy).bodies] == ["ground", "arm"]
    model = read_urdf(heavy, floating=True, gravity=(0.0, 0.0, 0.0)).build()
    assert [v.name for v in model.x][:4] == [f"floating_base_{k}" for k in ("x", "y", "z", "e0")]
    run = simulate(model, 2.0, x0={"hinge_rate": 3.0, "floating_base_y_rate": 0.1}, rtol=1e-9)
    # nothing from outside: the centre of mass moves on as it did, p_y = (3 y + 2 s) of the arm
    assert run["energy"][0] > run["energy"][-1]
    assert np.ptp(run["floating_base_y"] - 0.1 * run.t) < 1e-9


def test_mimic_joint_follows_and_its_mass_is_felt() -> None:
    """Of both joints with b = 0.2 - a/2 put in: the equation of one coordinate."""
    leader, small = '<mimic joint="a" multiplier="-0.5" offset="0.2"/>', (0.1, 0.1, 0.1)
    m = read_urdf(text_of(
        hinge("a", "world", "l1", "0 1 0"), bar("l1", weight(1, small, "0.1 0 0")),
        hinge("b", "l1", "l2", more=leader, kind="prismatic"), bar("l2", weight(2, small)),
    ))  # fmt: skip
    model = m.build()
    assert [v.name for v in model.u] == ["tau_a"]
    run = simulate(model, 1.0, rtol=1e-10, samples=11)
    assert run["b"] == pytest.approx(0.2 - run["a"] / 2, abs=1e-11)
    assert np.ptp(run["energy"]) < 1e-8
    f, s = functions(m), -0.5
    M, bias = f["mass"]([0.0, 0.2], []).full(), f["bias"]([0.0, 0.2], [0, 0], [0], []).full()
    T = np.array([[1.0], [s]])
    expected = -(T.T @ bias).item() / (T.T @ M @ T).item()
    short = simulate(model, 1e-3, rtol=1e-10, samples=2)
    assert short["a_rate"][-1] == pytest.approx(1e-3 * expected, rel=1e-3)


def test_all_that_is_left_out_is_reported_once() -> None:
    more = '<limit effort="0"/><safety_controller k_velocity="1"/></joint><gazebo/>'
    solids = '<sphere radius="1"/></geometry></visual><visual><geometry><mesh filename="a.stl"/>'
    visual = f"<visual><geometry>{solids}</geometry></visual></link>"
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        read_urdf(rod(**{"</joint>": more, "</inertial></link>": f"</inertial>{visual}"}))
    (message,) = (str(w.message) for w in caught)
    expected = "<mesh> of link 'arm', <safety_controller> of joint 'hinge'"
    limit = "<limit effort=\"0\"> of joint 'hinge'"
    assert message == f"urdf 'small': left out: {expected}, {limit}, <gazebo>"


def test_limits_of_the_file_bound_the_model_and_a_run_names_those_it_exceeds() -> None:
    text = rod(**{"</joint>": '<limit lower="-1" upper="2" effort="9" velocity="3"/></joint>'})
    m = read_urdf(text)
    model = m.build()
    found = {v.name: (v.lower, v.upper) for v in (*model.x, *model.u)}
    assert found == {"hinge": (-1.0, 2.0), "hinge_rate": (-3.0, 3.0), "tau_hinge": (-9.0, 9.0)}
    simulate(model, 0.05, x0={"hinge": 0.1}, u={"tau_hinge": 9.0})
    message = r"hinge_rate from t = 0\.\d+ s, up to .* rad/s \(-3 ... 3\); tau_hinge from t = 0 s"
    with pytest.warns(LimitWarning, match=f"'small': Bounds are exceeded: {message}"):
        run = simulate(model, 0.2, x0={"hinge": 0.1}, u={"tau_hinge": 20.0})
    first = float(run.doubts.partition("t = ")[2].split()[0])
    assert abs(run.at(np.array([first]))["hinge_rate"][0]) == pytest.approx(3.0, rel=0.1)
    stopped = read_urdf(text, stop_stiffness=500.0)
    assert sorted(stopped.limits) == ["hinge_rate", "tau_hinge"]
    one_sided = text.replace('"-1"', '"-1e16"')
    assert read_urdf(one_sided).limits["hinge"] == (-inf, 2.0)
    assert len(read_urdf(one_sided, stop_stiffness=500.0).build().x) == 2
    m.limit("hing", 0.0, 1.0)
    with pytest.raises(ValueError, match=r"'small' > limit: .* got hing"):
        m.build()


def test_solids_of_the_file_are_drawn_where_its_links_are() -> None:
    """Corners of a turned box on the arm by hand; the ground has a cylinder."""
    solid = '<visual><origin xyz="{}" rpy="{}"/><geometry><{}/></geometry></visual></link>'
    bars = solid.format("0 0 -0.5", f"0 0 {pi / 2}", 'box size="0.2 0.4 1"')
    base = solid.format("0 0 0", "0 0 0", 'cylinder radius="0.3" length="2"')
    world = f'<link name="world">{base}'
    links = {"</inertial></link>": f"</inertial>{bars}", '<link name="world"/>': world}
    m = read_urdf(rod(**links))
    model = m.build()
    sketch, angle = model.sketch(), 0.3
    places = ca.Function("places", [model.vector("x")], [sketch.places])([angle, 0.0]).full()
    axes, at = places[:9].T.reshape(-1, 3, 3, 1), places[9:].T[:, :, None]
    poses = Poses(axes, at, at[[part.centre for part in sketch.parts]])
    ground, arm = sketch.parts
    (found,) = outlines(arm, poses)
    half = np.array([0.2, 0.1, 0.5]) * np.array([*product((-1, 1), repeat=3)]) + [0.0, 0.0, -0.5]
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    expected = half @ turn.T + [0.0, 0.0, 1.0]
    corners = np.unique(found[np.isfinite(found[:, 0, 0]), :, 0].round(12), axis=0)
    assert corners == pytest.approx(np.unique(expected.round(12), axis=0), abs=1e-11)
    (found,) = outlines(ground, poses)
    rim = found[np.isfinite(found[:, 0, 0]), :, 0]
    assert np.hypot(rim[:, 0], rim[:, 1]) == pytest.approx(0.3)
    assert set(rim[:, 2].round(12)) == {-1.0, 1.0}
    view = look(sketch, poses)
    roles = [(s.role, s.body) for s in strokes(sketch, poses, view, {})]
    assert roles.count(("outline", -1)) == roles.count(("outline", 0)) == 1
    assert ("body", 0) not in roles
    assert (view.low <= expected.min(axis=0)).all()
    assert np.linalg.norm(sphere(0.7)[:25], axis=1) == pytest.approx(0.7)
    assert m.schematic().get_figwidth() > 0


def test_joints_stop_at_the_limits_of_the_file_on_request() -> None:
    """At rest on a stop, the weight and the spring of the stop balance."""
    old, limit = "</joint>", '<limit upper="-0.25" lower="-2" effort="9"/></joint>'
    for changes, joint, expected in (
        ({}, "revolute", brentq(lambda q: 2 * 9.81 * 0.25 * np.sin(q) + 500 * (q + 0.25), -1, 0)),
        ({'axis xyz="0 1 0"': 'axis xyz="0 0 -1"'}, "prismatic", -0.25 + 2 * 9.81 / 500),
    ):
        text = rod(**{old: limit, "revolute": joint, 'damping="0.3" friction="0.2"': 'damping="9"'},
                   **changes)  # fmt: skip
        m = read_urdf(text, stop_stiffness=500.0, stop_dissipation=1.0)
        run = simulate(m.build(), 60.0, x0={"hinge": -0.8}, rtol=1e-8)
        assert run.final["hinge"] == pytest.approx(expected, abs=1e-6)
    for text in (SMALL, rod(**{old: '<limit effort="9"/></joint>'})):
        assert not [f for f in read_urdf(text, stop_stiffness=1.0).forces if f.kind == "stop"]
    with pytest.raises(ValueError, match="urdf: stop_stiffness: expected a number >= 0, got -1"):
        read_urdf(SMALL, stop_stiffness=-1.0)
    with pytest.raises(
        ValueError, match="stop_stiffness: expected > 0 with stop_dissipation, got 0"
    ):
        read_urdf(SMALL, stop_dissipation=1.0)


def test_names_are_kept_apart() -> None:
    """A link and its joint of one name, and a link called ground."""
    text = rod(arm="ground", hinge="ground").replace("world", "1 base")
    with pytest.warns(
        UserWarning, match="joint 'ground' to ground_joint, link 'ground' to ground_"
    ):
        m = read_urdf(text)
    assert [v.name for v in m.build().x] == ["ground_joint", "ground_joint_rate"]
    assert {place for place, _ in m.frames} >= {"ground._1_base", "ground_link.ground_link"}


def test_what_cannot_be_a_mechanism_is_refused() -> None:
    massless = rod(**{'mass value="2"': 'mass value="0"', "0.1": "0", "0.01": "0"})
    others = (hinge("a_b", "arm", "x"), hinge("a_b_joint", "arm", "y"))
    alike = "".join((*others, bar("x", weight()), bar("y", weight()), "</robot>"))
    for text, message in (
        (massless, "urdf 'small' > joint 'hinge': expected links with a mass > 0 kg that it moves"),
        (rod(hinge="a-b", **{"</robot>": alike}),
         "joint 'a-b': expected a name that differs from that of joint 'a_b_joint' as a C ident"),
    ):  # fmt: skip
        with pytest.raises(ValueError, match=message):
            read_urdf(text)


def test_inertia_that_no_body_has_is_used_with_a_warning_or_refused() -> None:
    text, named = rod(**{'izz="0.01"': 'izz="0.5"'}), "link 'arm' > inertial > inertia: expect"
    with pytest.warns(UserWarning, match=f"accepted unchanged: {named}"):
        m = read_urdf(text)
    assert [float(x) for x in m.bodies[1].inertia] == [0.1, 0.1, 0.5, 0, 0, 0]
    assert float(functions(m)["mass"](0, [])) == pytest.approx(0.1 + 2 * 0.25**2)
    with pytest.raises(ValueError, match=f"urdf 'small' > {named}"):
        read_urdf(text, strict=True)
    message = "positive definite, got one that is not in hinge: the"
    with pytest.warns(UserWarning, match="link 'arm'"), pytest.raises(ValueError, match=message):
        read_urdf(text.replace('iyy="0.1"', 'iyy="-0.5"')).build()


def test_massless_links_between_joints_make_one_joint_of_several_axes() -> None:
    """Two hinges at a point, about x and y: a universal joint, by its own equations."""
    robot = read_urdf(
        text_of(bar("cross"), bar("arm", HEAVY), hinge("a", "world", "cross", "1 0 0"),
                hinge("b", "cross", "arm", "0 1 0")), strict=True,
    )  # fmt: skip
    _, cross, arm = robot.bodies
    assert (cross.mass, cross.ideal, arm.ideal) == (0.0, True, False)
    m = Mechanism("r")
    m.body("arm", arm.mass, arm.inertia, arm.com)
    m.joint(Universal("u", "ground", "arm"))
    q, qd, a = np.random.default_rng(0).normal(size=(3, 2))
    found, expected = (
        functions(x)["inverse_dynamics"](q, qd, a, [], [], [0] * len(x.inputs), [])
        for x in (robot, m)
    )
    assert found.full() == pytest.approx(expected.full(), rel=1e-13)
    runs = [simulate(x.build(), 0.5, rtol=1e-9, backend="vm", samples=5) for x in (robot, m)]
    for mine, theirs in (("a", "u_x"), ("b", "u_y")):
        assert runs[0][mine] == pytest.approx(runs[1][theirs], abs=1e-8)
    with pytest.raises(ValueError, match="body 'cross': expected a rigid body in absolute coord"):
        robot.build(formulation="absolute")


def test_joints_that_move_no_mass_are_held_with_a_warning_or_refused() -> None:
    """A finger of two massless links on a heavy arm."""
    text = text_of(
        bar("arm", HEAVY), bar("f1"), bar("f2"), hinge("a", "world", "arm", "1 0 0"),
        hinge("b", "arm", "f1", "1 0 0"), hinge("c", "f1", "f2", "0 1 0", '<mimic joint="b"/>'),
    )  # fmt: skip
    with pytest.warns(
        UserWarning, match="fixed at zero, because they move no mass: joint 'b', joi"
    ):
        m = read_urdf(text)
    assert ([j.name for j in m.joints], [v.name for v in m.inputs]) == (["a"], ["tau_a"])
    assert "arm.f2" in {place for place, _ in m.frames}
    with pytest.raises(ValueError, match="joint 'b': expected links with a mass") as caught:
        read_urdf(text, strict=True)
    assert len(str(caught.value).splitlines()) == 2
    heavy = text.replace('name="f2">', f'name="f2">{HEAVY}').replace(
        '<parent link="f1"/>', '<parent link="arm"/>'
    )
    with pytest.raises(ValueError, match="joint 'c' > mimic: expected a joint that moves a mass"):
        read_urdf(heavy)


def test_parallel_axes_of_massless_links_are_refused_by_build() -> None:
    """Both turn the same body the same way: the difference of the two angles moves nothing."""
    text = text_of(bar("cross"), bar("arm", HEAVY), hinge("a", "world", "cross", "0 1 0"),
                   hinge("b", "cross", "arm", "0 2 0"))  # fmt: skip
    with pytest.raises(ValueError, match=r"mechanism 'r' > expected a mass matrix .* in a, b: "):
        read_urdf(text).build()


def test_point_mass_on_a_rod_swings() -> None:
    """Guards against refusing an inertia of zeros: g sin(q) / l."""
    text = text_of(bar("bob", weight(3, (0,), "0 0 -0.4")), hinge("a", "world", "bob", "0 1 0"))
    f = read_urdf(text, strict=True).build().function("ode")
    assert float(f(0, [0.3, 0], [], [0], [])[1]) == pytest.approx(-9.81 * np.sin(0.3) / 0.4)
    onto = text.replace("0 0 -0.4", "0 0.4 0")
    with pytest.raises(
        ValueError, match=r"expected a mass matrix .* not in a: the bodies they move"
    ):
        read_urdf(onto).build()


def test_mass_matrix_may_have_zeros_on_one_side_only() -> None:
    """Guards against CasADi's "LDL factorization requires a symmetric matrix" in build()."""
    a, b = weight(at="0 0.1 0"), weight(at="0 0 0.1")
    m = read_urdf(
        text_of(bar("a", a), bar("b", b), hinge("p", "world", "a", "1 0 0"),
                hinge("q", "a", "b", "0 1 0"))
    )  # fmt: skip
    eq = m.prepare().eq
    assert not eq.mass.sparsity().is_symmetric()
    q, qd = np.random.default_rng(0).normal(size=(2, 2))
    f = functions(m)
    M, bias = f["mass"](q, []).full(), f["bias"](q, qd, [1, 2], []).full().ravel()
    found = m.build().function("ode")(0, [*q, *qd], [], [1, 2], []).full().ravel()
    assert found[2:] == pytest.approx(np.linalg.solve(M, -bias), rel=1e-12)


def test_massless_tips_are_held() -> None:
    for inertial, held in (("", ("tip",)), (weight(), ())):
        more = hinge("tip", "arm", "hand") + bar("hand", inertial)
        urdf, names = holding(parse(SMALL.replace("</robot>", f"{more}</robot>")))
        assert names == held
        assert urdf.joints[1].kind == ("fixed" if held else "continuous")
