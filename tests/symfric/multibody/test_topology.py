"""The spanning tree keeps the joints with most constraints and cuts the others."""

from symfric.multibody import (
    GROUND,
    Body,
    Cylindrical,
    Distance,
    Fixed,
    Prismatic,
    Revolute,
    Spherical,
)
from symfric.multibody.topology import absolute, spanning_tree

BODIES = {name: Body(name, 1.0, (1.0, 1.0, 1.0)) for name in (GROUND, "a", "b", "c")}


def test_the_joints_with_fewest_constraints_are_cut_and_bodies_hang_near_the_ground() -> None:
    ball = Spherical("ball", GROUND, "a")
    for joints, tree, loops in (
        ((Revolute("1", GROUND, "a"), Prismatic("2", "a", "b"), Spherical("3", "b", "c")),
         ["1", "2", "3"], []),
        ((ball, Cylindrical("tube", "a", "b"), Revolute("hinge", "b", "c"),
          Fixed("weld", "c", GROUND)), ["weld", "hinge", "tube"], ["ball"]),
        ((Distance("rod", GROUND, "a"), ball), ["ball"], ["rod"]),
        ((Revolute("1", GROUND, "a"), Revolute("2", "a", "b"), Revolute("3", GROUND, "b"),
          Revolute("4", "b", "c")), ["1", "3", "4"], ["2"]),
    ):  # fmt: skip
        topology = spanning_tree(BODIES, joints)
        assert [link.joint.name for link in topology.links] == tree
        assert [joint.name for joint in topology.loops] == loops


def test_a_joint_whose_child_is_nearer_to_the_ground_is_turned_round() -> None:
    (link,) = spanning_tree(BODIES, [Revolute("1", "a", GROUND)]).links
    assert (link.base, link.body, link.reverse) == (GROUND, "a", True)


def test_absolute_coordinates_cut_every_joint() -> None:
    joints = Revolute("1", GROUND, "a"), Revolute("2", "a", "b")
    topology = absolute(BODIES, joints, {"a": (), "b": ()})
    assert topology.n == 14
    assert [j.name for j in topology.loops] == ["1", "2"]
    assert [link.rows for link in topology.links] == [slice(0, 7), slice(7, 14)]
