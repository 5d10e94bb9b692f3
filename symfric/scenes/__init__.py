"""Predefined machines that accept any friction law."""

from typing import TYPE_CHECKING

from symfric.foundation.lazy import load_lazily

if TYPE_CHECKING:
    from symfric.scenes.base import GivenInput as GivenInput
    from symfric.scenes.base import Scene as Scene
    from symfric.scenes.base import contact as contact
    from symfric.scenes.base import other_law as other_law
    from symfric.scenes.blocks import CoupledBlocks as CoupledBlocks
    from symfric.scenes.blocks import Drive as Drive
    from symfric.scenes.blocks import Rabinowicz as Rabinowicz
    from symfric.scenes.blocks import drive as drive
    from symfric.scenes.blocks import rabinowicz as rabinowicz
    from symfric.scenes.catalogue import ALL_SCENES as ALL_SCENES
    from symfric.scenes.catalogue import MECHANISMS as MECHANISMS
    from symfric.scenes.linkages import DoublePendulum as DoublePendulum
    from symfric.scenes.linkages import FourBar as FourBar
    from symfric.scenes.linkages import MechanismScene as MechanismScene
    from symfric.scenes.linkages import Pendulum as Pendulum
    from symfric.scenes.linkages import PendulumBox as PendulumBox
    from symfric.scenes.linkages import SliderCrank as SliderCrank
    from symfric.scenes.presets import Numbers as Numbers
    from symfric.scenes.presets import Preset as Preset
    from symfric.scenes.rigs import Prescribed as Prescribed
    from symfric.scenes.rigs import QuarterCar as QuarterCar
    from symfric.scenes.rotating import Clutch as Clutch
    from symfric.scenes.rotating import DrillString as DrillString
    from symfric.scenes.rotating import Nip as Nip
    from symfric.scenes.spatial import Arm as Arm
    from symfric.scenes.spatial import FourMass as FourMass
    from symfric.scenes.spatial import Robot as Robot

load_lazily(__name__)
