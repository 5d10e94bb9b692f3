"""The spanning tree keeps the joints with most constraints and cuts the others."""

from symfric.multibody import (
    GROUND,
    Body,
    Cylindrical,
    Distance,
    Fixed,
    Joint,
    Prismatic,
    Revolute,
    Spherical,
)
from symfric.multibody.topology import absolute, spanning_tree

BODIES = {name: Body(name, 1.0, (1.0, 1.0, 1.0)) for name in (GROUND, "a", "b", "c")}


def cut(*joints: Joint) -> tuple[list[str], list[str]]:
    topology = spanning_tree(BODIES, joints)
    return [link.joint.name for link in topology.links], [j.name for j in topology.loops]


def test_a_chain_has_no_loops() -> None:
    joints = Revolute("1", GROUND, "a"), Prismatic("2", "a", "b"), Spherical("3", "b", "c")
    assert cut(*joints) == (["1", "2", "3"], [])


def test_the_joint_with_fewest_constraints_is_cut() -> None:
    joints = (
        Spherical("ball", GROUND, "a"),
        Cylindrical("tube", "a", "b"),
        Revolute("hinge", "b", "c"),
        Fixed("weld", "c", GROUND),
    )
    assert cut(*joints) == (["weld", "hinge", "tube"], ["ball"])


def test_distances_are_always_cut() -> None:
    joints = Distance("rod", GROUND, "a"), Spherical("ball", GROUND, "a")
    assert cut(*joints) == (["ball"], ["rod"])


def test_bodies_hang_as_near_to_the_ground_as_they_can() -> None:
    joints = (
        Revolute("1", GROUND, "a"),
        Revolute("2", "a", "b"),
        Revolute("3", GROUND, "b"),
        Revolute("4", "b", "c"),
    )
    assert cut(*joints) == (["1", "3", "4"], ["2"])


def test_a_joint_whose_child_is_nearer_to_the_ground_is_turned_round() -> None:
    (link,) = spanning_tree(BODIES, [Revolute("1", "a", GROUND)]).links
    assert (link.base, link.body, link.reverse) == (GROUND, "a", True)


def test_absolute_coordinates_cut_every_joint() -> None:
    joints = Revolute("1", GROUND, "a"), Revolute("2", "a", "b")
    topology = absolute(BODIES, joints, {"a": (), "b": ()})
    assert topology.n == 14
    assert [j.name for j in topology.loops] == ["1", "2"]
    assert [link.rows for link in topology.links] == [slice(0, 7), slice(7, 14)]
