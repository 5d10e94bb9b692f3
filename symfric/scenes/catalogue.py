"""The ready machines by name."""

from symfric.scenes.arm import Arm
from symfric.scenes.base import Scene
from symfric.scenes.clutch import Clutch
from symfric.scenes.coupled_blocks import CoupledBlocks
from symfric.scenes.drill_string import DrillString
from symfric.scenes.drive import Drive
from symfric.scenes.four_bar import FourBar
from symfric.scenes.four_mass import FourMass
from symfric.scenes.mechanism import MechanismScene
from symfric.scenes.nip import Nip
from symfric.scenes.pendulum import DoublePendulum, Pendulum
from symfric.scenes.pendulum_box import PendulumBox
from symfric.scenes.prescribed import Prescribed
from symfric.scenes.quarter_car import QuarterCar
from symfric.scenes.rabinowicz import Rabinowicz
from symfric.scenes.slider_crank import SliderCrank

MECHANISMS: dict[str, type[MechanismScene]] = {
    "pendulum": Pendulum,
    "double_pendulum": DoublePendulum,
    "pendulum_box": PendulumBox,
    "four_mass": FourMass,
    "slider_crank": SliderCrank,
    "four_bar": FourBar,
    "arm": Arm,
}
"""Scenes of several bodies, with the same law in several joints."""

ALL_SCENES: dict[str, type[Scene]] = {
    "rabinowicz": Rabinowicz,
    "drive": Drive,
    "quarter_car": QuarterCar,
    "coupled_blocks": CoupledBlocks,
    "drill_string": DrillString,
    "clutch": Clutch,
    "nip": Nip,
    "prescribed": Prescribed,
    **MECHANISMS,
}
"""Every scene by the name the command line uses."""
