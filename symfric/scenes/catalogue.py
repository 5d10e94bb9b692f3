"""The ready machines by name."""

from symfric.scenes.base import Scene
from symfric.scenes.drive import Drive
from symfric.scenes.linkages import DoublePendulum, FourBar, Pendulum, PendulumBox
from symfric.scenes.mechanism import MechanismScene
from symfric.scenes.rabinowicz import CoupledBlocks, Rabinowicz
from symfric.scenes.rigs import Prescribed, QuarterCar
from symfric.scenes.rotating import Clutch, DrillString, Nip
from symfric.scenes.slider_crank import SliderCrank
from symfric.scenes.spatial import Arm, FourMass

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
