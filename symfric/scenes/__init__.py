"""Ready machines: each takes any friction law and gives a `Model`."""

from collections.abc import Iterable

from symfric.foundation.numeric import Scalar
from symfric.foundation.parameters import with_values
from symfric.laws import Law
from symfric.model import Model
from symfric.scenes.arm import Arm as Arm
from symfric.scenes.base import GivenInput as GivenInput
from symfric.scenes.base import Scene as Scene
from symfric.scenes.base import friction_states as friction_states
from symfric.scenes.drive import Drive as Drive
from symfric.scenes.four_bar import FourBar as FourBar
from symfric.scenes.four_mass import FourMass as FourMass
from symfric.scenes.mechanism import MechanismScene as MechanismScene
from symfric.scenes.pendulum import DoublePendulum as DoublePendulum
from symfric.scenes.pendulum import Pendulum as Pendulum
from symfric.scenes.pendulum_box import PendulumBox as PendulumBox
from symfric.scenes.quarter_car import QuarterCar as QuarterCar
from symfric.scenes.rabinowicz import Rabinowicz as Rabinowicz
from symfric.scenes.robot import Robot as Robot
from symfric.scenes.slider_crank import SliderCrank as SliderCrank

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
    **MECHANISMS,
}
"""Every scene by the name the command line uses."""


def rabinowicz(law: Law, *, free: Iterable[str] = (), **parameters: Scalar) -> Model:
    """Model of a block on a belt with friction `law`.

    `parameters` are m, k, v_belt, g and those of the law, by name. Those named in
    `free` become symbols in `Model.p`.
    """
    return with_values(Rabinowicz(law), parameters).model(free)


def drive(law: Law, *, free: Iterable[str] = (), **parameters: Scalar) -> Model:
    """Model of a mass with force input and friction `law`.

    `parameters` are m, N, offset and those of the law, by name. Those named in
    `free` become symbols in `Model.p`.
    """
    return with_values(Drive(law), parameters).model(free)
