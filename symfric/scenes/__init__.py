"""Ready machines: each takes any friction law and gives a `Model`."""

from typing import TYPE_CHECKING

from symfric.foundation.fronts import hand_out

if TYPE_CHECKING:
    from symfric.scenes.arm import Arm as Arm
    from symfric.scenes.base import GivenInput as GivenInput
    from symfric.scenes.base import Scene as Scene
    from symfric.scenes.base import contact as contact
    from symfric.scenes.base import friction_states as friction_states
    from symfric.scenes.base import other_law as other_law
    from symfric.scenes.catalogue import ALL_SCENES as ALL_SCENES
    from symfric.scenes.catalogue import MECHANISMS as MECHANISMS
    from symfric.scenes.clutch import Clutch as Clutch
    from symfric.scenes.coupled_blocks import CoupledBlocks as CoupledBlocks
    from symfric.scenes.drill_string import DrillString as DrillString
    from symfric.scenes.drive import Drive as Drive
    from symfric.scenes.drive import drive as drive
    from symfric.scenes.four_bar import FourBar as FourBar
    from symfric.scenes.four_mass import FourMass as FourMass
    from symfric.scenes.mechanism import MechanismScene as MechanismScene
    from symfric.scenes.nip import Nip as Nip
    from symfric.scenes.pendulum import DoublePendulum as DoublePendulum
    from symfric.scenes.pendulum import Pendulum as Pendulum
    from symfric.scenes.pendulum_box import PendulumBox as PendulumBox
    from symfric.scenes.prescribed import Prescribed as Prescribed
    from symfric.scenes.presets import Numbers as Numbers
    from symfric.scenes.presets import Preset as Preset
    from symfric.scenes.quarter_car import QuarterCar as QuarterCar
    from symfric.scenes.rabinowicz import Rabinowicz as Rabinowicz
    from symfric.scenes.rabinowicz import rabinowicz as rabinowicz
    from symfric.scenes.robot import Robot as Robot
    from symfric.scenes.slider_crank import SliderCrank as SliderCrank
else:
    hand_out(
        __name__,
        {
            "symfric.scenes.arm": "Arm",
            "symfric.scenes.base": "GivenInput Scene contact friction_states other_law",
            "symfric.scenes.catalogue": "ALL_SCENES MECHANISMS",
            "symfric.scenes.clutch": "Clutch",
            "symfric.scenes.coupled_blocks": "CoupledBlocks",
            "symfric.scenes.drill_string": "DrillString",
            "symfric.scenes.drive": "Drive drive",
            "symfric.scenes.four_bar": "FourBar",
            "symfric.scenes.four_mass": "FourMass",
            "symfric.scenes.mechanism": "MechanismScene",
            "symfric.scenes.nip": "Nip",
            "symfric.scenes.pendulum": "DoublePendulum Pendulum",
            "symfric.scenes.pendulum_box": "PendulumBox",
            "symfric.scenes.prescribed": "Prescribed",
            "symfric.scenes.presets": "Numbers Preset",
            "symfric.scenes.quarter_car": "QuarterCar",
            "symfric.scenes.rabinowicz": "Rabinowicz rabinowicz",
            "symfric.scenes.robot": "Robot",
            "symfric.scenes.slider_crank": "SliderCrank",
        },
    )
