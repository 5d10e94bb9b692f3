"""URDF files as data: what is read, and bad files refused with the path of every mistake."""

from math import pi
from pathlib import Path

import numpy as np
import pytest
from robots import SMALL

from symfric.multibody.outlines import box, cylinder, sphere
from symfric.multibody.urdf_file import parse
from symfric.multibody.urdf_text import rotation

LINK = (
    '<link name="tip"><inertial><mass value="1"/>'
    '<inertia ixx="1" iyy="1" izz="1"/></inertial></link>'
)


def joint(inside: str = "", name: str = "wrist", kind: str = "continuous") -> str:
    ends = '<parent link="arm"/><child link="tip"/>'
    return f'<joint name="{name}" type="{kind}">{ends}{inside}</joint>'


def small(*more: str) -> str:
    return SMALL.replace("</robot>", "".join(more) + "</robot>")


def test_numbers_of_links_and_joints_are_read() -> None:
    mimic = '<origin xyz="1 2 3"/><mimic joint="hinge" multiplier="-2"/>'
    urdf = parse(small(joint(mimic), LINK))
    hinge, wrist = urdf.joints
    assert (hinge.kind, hinge.damping, hinge.friction) == ("revolute", 0.3, 0.2)
    assert (hinge.axis.tolist(), hinge.p.tolist()) == ([0, 1, 0], [0, 0, 1])
    assert (wrist.p.tolist(), wrist.axis.tolist()) == ([1, 2, 3], [1, 0, 0])
    assert wrist.mimic is not None
    assert (wrist.mimic.joint, wrist.mimic.multiplier, wrist.mimic.offset) == ("hinge", -2.0, 0.0)
    arm = urdf.links["arm"]
    assert arm is not None
    assert (arm.mass, arm.com.tolist(), np.diag(arm.J).tolist()) == (
        2,
        [0, 0, -0.25],
        [0.1, 0.1, 0.01],
    )
    assert (urdf.root, urdf.links["world"]) == ("world", None)


@pytest.mark.parametrize(
    ("kind", "limit", "limits", "left"),
    [
        ("prismatic", 'lower="-1" upper="2.5" effort="7"', (-1.0, 2.5, 7.0, None), ""),
        ("revolute", 'upper="2"', (0.0, 2.0, None, None), ""),
        ("revolute", 'lower="1" upper="-1" velocity="3"', (None, None, None, 3.0), "lower, upper"),
        ("continuous", 'upper="9" velocity="3"', (None, None, None, 3.0), "lower, upper"),
        ("revolute", 'lower="0" upper="0" effort="0" velocity="-1.0"', (None,) * 4,
         'effort="0"> of joint \'wrist\' <limit velocity="-1.0"'),
        ("revolute", 'lower="-1e16" upper="1e16" effort="9"', (None, None, 9.0, None), ""),
        ("revolute", 'lower="-1e16" upper="2"', (-1e16, 2.0, None, None), ""),
        ("planar", 'effort="9" velocity="2"', (None,) * 4, None),
        ("fixed", 'lower="-1" upper="2.5" effort="7"', (None,) * 4, ""),
    ],
)  # fmt: skip
def test_limits_apply_where_they_mean_something(
    kind: str, limit: str, limits: tuple[float | None, ...], left: str | None
) -> None:
    urdf = parse(small(joint(f"<limit {limit}/>", kind=kind), LINK))
    given = zip(("lower", "upper", "effort", "velocity"), limits, strict=True)
    assert urdf.joints[1].limits == {key: x for key, x in given if x is not None}
    said = f"<limit{'' if left is None else f' {left}'}> of joint 'wrist'"
    assert " ".join(urdf.left_out) == ("" if left == "" else said)


@pytest.mark.parametrize(
    ("tag", "damping", "friction", "left"),
    [
        ('<dynamics mu_viscous="16" mu_coulomb="0.4"/>', 16.0, 0.4, ""),
        ("<dynamics><damping> 0.5 </damping><friction>2</friction></dynamics>", 0.5, 2.0, ""),
        ('<dynamics damping="1"><damping>5</damping><mu_coulomb>3</mu_coulomb></dynamics>', 1, 3,
         ""),
        ('<dynamics damping="0" mu_viscous="16"/>', 0.0, 0.0, "mu_viscous"),
        ('<dynamics D="1" damping="0.1" friction="0" mu_coulomb="0"/>', 0.1, 0.0, "D"),
        ("<dynamics/>", 0.0, 0.0, ""),
        ('<dynamics Damping="1" frictionloss="0.2" armature="1"/>', 1.0, 0.2, "armature"),
    ],
)  # fmt: skip
def test_friction_of_any_dialect(tag: str, damping: float, friction: float, left: str) -> None:
    urdf = parse(small(joint(tag), LINK))
    assert (urdf.joints[1].damping, urdf.joints[1].friction) == (damping, friction)
    assert list(urdf.left_out) == ([f"<dynamics {left}> of joint 'wrist'"] if left else [])


def test_angles_turn_about_fixed_axes_and_quarter_turns_are_exact() -> None:
    for angles, x, z in (
        ((pi / 2, 0, 0), [1, 0, 0], [0, -1, 0]), ((0, pi / 2, 0), [0, 0, -1], [1, 0, 0]),
        ((0, 0, pi / 2), [0, 1, 0], [0, 0, 1]), ((pi / 2, 0, pi / 2), [0, 1, 0], [1, 0, 0]),
    ):  # fmt: skip
        assert rotation(*angles)[:, [0, 2]].T.tolist() == [x, z]
    arm = parse(SMALL.replace('xyz="0 0 -0.25"', f'rpy="0 {pi / 2} 0"')).links["arm"]
    assert arm is not None
    assert np.diag(arm.J) == pytest.approx([0.01, 0.1, 0.1])


def test_appearance_is_passed_over_and_everything_else_is_named() -> None:
    inside = '<dynamics damping="1" spring_stiffness="2"/><calibration rising="0"/>'
    link = LINK.replace("<inertial>", "<visual/><collision/><sensor/><inertial>")
    more = '<material name="red"/><gazebo/><gazebo/><drake:actuator/><transmission name="t"/>'
    urdf = parse(small(more, joint(inside), link))
    assert sorted(urdf.left_out) == [
        "<calibration> of joint 'wrist'",
        "<drake:actuator>",
        "<dynamics spring_stiffness> of joint 'wrist'",
        "<gazebo>",
        "<sensor> of link 'tip'",
        "<transmission>",
    ]


def test_solids_are_read_in_all_dialects_and_bad_ones_are_no_mistakes() -> None:
    solids = (
        '<box size="1 2 3"/>', '<drake:capsule radius="1" length="2"/>', '<sphere radius="2"/>',
        '<mesh filename="a.stl"/>', '<box size="1 2"/>', '<cylinder length="1"/>',
    )  # fmt: skip
    shapes = "".join(f"<visual><geometry>{solid}</geometry></visual>" for solid in solids)
    turned = '<visual><origin rpy="0 90 0"/></visual>'
    text = small(joint(), LINK.replace("<inertial>", f"{shapes}{turned}<inertial>"))
    urdf = parse("\ufeff" + text)
    where = "link 'tip' > visual"
    assert urdf.doubts == (
        f"{where}: expected 3 numbers in size, got '1 2'",
        f"{where} > origin: expected rpy in radians, got 0, 90, 0",
    )
    assert urdf.left_out == tuple(f"<{tag}> of link 'tip'" for tag in ("mesh", "box", "cylinder"))
    corners, found = box(1.0, 2.0, 3.0), urdf.outlines["tip"]
    assert np.array_equal(found[: len(corners)], corners, equal_nan=True)
    assert len(found) == len(corners) + len(cylinder(1.0, 2.0)) + len(sphere(2.0))
    assert np.nanmax(np.linalg.norm(found[-len(sphere(2.0)) :], axis=1)) == pytest.approx(2.0)


BAD = [
    ("<robot", r"^urdf: expected XML, got unclosed token: line 1, column 0"),
    ("<sdf/>", r"^urdf: expected <robot> as its outermost tag, got <sdf>"),
    ('<robot name="a"/>', r"urdf 'a' > link: expected at least one, got none"),
    (small(LINK), r"expected one link that no joint carries, got world, tip"),
    (small(joint()), r"joint 'wrist' > child: expected a link, got 'tip'"),
    (small(LINK, joint(), joint(name="other")),
     r"link 'tip': expected one joint that carries it, got wrist, other"),
    (small(LINK, joint(name="hinge")), r"joint 'hinge': expected every name once"),
    (small(LINK, LINK, joint()), r"link 'tip': expected every name once"),
    (small(LINK, joint(name="")), r"joint: expected a name, found none"),
    (small(LINK, joint(kind="ball")),
     r"joint 'wrist' > type: expected one of revolute, .*, planar, got 'ball'"),
    (small(LINK, joint("<dynamics><friction/></dynamics>")),
     r"joint 'wrist' > dynamics: expected a number in friction, got ''"),
    (small(LINK, joint('<dynamics mu_viscous="-1"/>')),
     r"joint 'wrist' > dynamics > mu_viscous: expected >= 0, got -1"),
    (small(LINK, joint('<axis xyz="0 1"/>')),
     r"urdf 'small' > joint 'wrist' > axis: expected 3 numbers in xyz, got '0 1'"),
    (small(LINK, joint('<axis xyz="0 0 0"/>')), r"joint 'wrist' > axis: expected a direction"),
    (small(LINK, joint('<origin rpy="0 0 nan"/>')),
     r"joint 'wrist' > origin: expected 3 numbers in rpy, got '0 0 nan'"),
    (small(LINK, joint('<dynamics damping="-1"/>')),
     r"joint 'wrist' > dynamics > damping: expected >= 0, got -1"),
    (small(LINK, joint(), "<Link/>"), "<Link>: expected <link>, in lower case"),
    (small(LINK, joint('<limit lower="low"/>')),
     r"joint 'wrist' > limit: expected a number in lower, got 'low'"),
    (small(LINK, joint('<mimic joint="wrist"/>')), r"joint 'wrist' > mimic: .* got 'wrist'"),
    (small(LINK, joint('<mimic joint="hinge"/>', kind="planar")), r"joint 'wrist' > mimic"),
    (small(LINK, joint().replace('<child link="tip"/>', "")),
     r"joint 'wrist' > child: expected the name of a link, found none"),
    (small(LINK.replace('<mass value="1"/>', ""), joint()),
     r"link 'tip' > inertial > mass: expected a tag, found none"),
    (small(LINK.replace('value="1"', 'value="-1"'), joint()),
     r"link 'tip' > inertial > mass: expected >= 0 kg, got -1"),
    (small('<link name="a"/><link name="b"/>',
           joint(name="ab").replace("arm", "a").replace("tip", "b"),
           joint(name="ba").replace("arm", "b").replace("tip", "a")),
     r"link 'a': expected joints that lead to 'world', got a closed loop"),
    (small('<xacro:property name="a"/>'),
     r"<xacro>: expected plain URDF; expand the file with xacro"),
]  # fmt: skip


def test_bad_files_are_refused_with_the_path_of_the_mistake() -> None:
    for text, message in BAD:
        with pytest.raises(ValueError, match=message):
            parse(text)
    several = LINK.replace('value="1"', 'value="-1"'), joint('<axis xyz="0 1"/>', kind="ball")
    with pytest.raises(ValueError, match="mass") as caught:
        parse(small(*several))
    assert len(str(caught.value).splitlines()) == 3


def test_joints_without_an_axis_may_have_one_of_zeros() -> None:
    """Guards against refusing a file for the axis of a fixed joint: exporters write zeros there."""
    for kind in ("fixed", "floating"):
        wrist = parse(small(LINK, joint('<axis xyz="0 0 0"/>', kind=kind))).joints[1]
        assert wrist.axis.tolist() == [1, 0, 0]


def inertia(mass: float, entries: str) -> str:
    old = '<mass value="1"/><inertia ixx="1" iyy="1" izz="1"/>'
    assert old in LINK
    return small(LINK.replace(old, f'<mass value="{mass}"/><inertia {entries}/>'), joint())


def test_rounding_of_an_inertia_is_zero() -> None:
    """Guards against refusing -2.4e-35 kg m^2, and zeros, of a link that is a point."""
    for entries in ('ixz="2.4e-35"', 'ixx="-1.4e-20" iyy="1.4e-20"', 'ixx="0"'):
        urdf = parse(inertia(1.3, entries), strict=True)
        tip = urdf.links["tip"]
        assert tip is not None
        assert (tip.mass, tip.J.any(), urdf.doubts) == (1.3, False, ())
    for least in ("0", "-1e-11"):  # of a thin rod
        assert parse(inertia(1.3, f'ixx="{least}" iyy="1" izz="1"'), strict=True).doubts == ()


def test_inertia_of_no_body_is_kept_and_named_or_refused() -> None:
    for mass, numbers, doubt in (
        (1, (-0.1, 1, 1), "inertia: expected no negative principal moment, got"),
        (1, (1, 1, 3), "inertia: expected the largest principal moment to be at"),
        (0, (1, 1, 1), "mass: expected > 0 kg, because there is an inertia, got 0"),
    ):
        text = inertia(mass, 'ixx="{}" iyy="{}" izz="{}"'.format(*numbers))
        urdf, doubt = parse(text), f"link 'tip' > inertial > {doubt}"
        assert urdf.links["tip"] is not None
        assert np.diag(urdf.links["tip"].J).tolist() == list(numbers)
        assert [d.startswith(doubt) for d in urdf.doubts] == [True]
        with pytest.raises(ValueError, match=f"urdf 'small' > {doubt}"):
            parse(text, strict=True)


def test_joint_whose_leader_is_missing_moves_on_its_own_or_is_refused() -> None:
    text = small(LINK, joint('<mimic joint="elbow"/>'))
    urdf = parse(text)
    doubt = "joint 'wrist' > mimic: expected a joint of the file, got elbow"
    assert (urdf.joints[1].mimic, urdf.doubts) == (None, (doubt,))
    with pytest.raises(ValueError, match=doubt):
        parse(text, strict=True)


def test_mistakes_in_a_file_name_the_file(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text("<robot>")
    with pytest.raises(ValueError, match=r"urdf '.*arm.urdf': expected XML, got no element found"):
        parse(path)
    path.write_text(SMALL.replace(' name="small"', ""))
    assert parse(path).name == "arm"
    with pytest.raises(ValueError, match=r"leg.urdf': expected a file, got nothing there"):
        parse(tmp_path / "leg.urdf")
