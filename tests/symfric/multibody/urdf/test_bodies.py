"""Which links of a URDF file are one body; what moves no mass is held."""

import numpy as np
import pytest
from robots import SMALL

from symfric.multibody.urdf import carried, holding, merged
from symfric.multibody.urdf_file import parse

TIP = '<joint name="tip" type="{}"><parent link="arm"/><child link="hand"/></joint>{}</robot>'
HAND = '<link name="hand"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial>'


def test_nothing_is_held_where_every_joint_moves_a_mass() -> None:
    urdf = parse(SMALL)
    assert holding(urdf) == (urdf, ())


def test_a_massless_tip_is_held_and_a_heavy_one_is_not() -> None:
    for link, expected in (('<link name="hand"/>', ("tip",)), (f"{HAND}</link>", ())):
        urdf = parse(SMALL.replace("</robot>", TIP.format("continuous", link)))
        held = holding(urdf)
        assert held[1] == expected
        assert [j.kind for j in held[0].joints][1] == ("fixed" if expected else "continuous")


def test_links_on_fixed_joints_are_merged() -> None:
    urdf = parse(SMALL.replace("</robot>", TIP.format("fixed", f"{HAND}</link>")))
    places = carried(urdf)
    assert places["hand"].body == "arm"
    whole = merged(urdf, places, "arm")
    assert (whole.mass, whole.com.tolist()) == (3.0, [0, 0, -0.5 / 3])
    # two masses 0.25 m apart, reduced mass 2/3 kg
    apart = 0.25**2 * 2 / 3
    assert np.diag(whole.J) == pytest.approx([1.1 + apart, 1.1 + apart, 1.01])
