"""A robot from a URDF file."""

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, final

from symfric.foundation.numeric import Scalar
from symfric.foundation.parameters import param
from symfric.multibody import Mechanism
from symfric.multibody.urdf.read import read_urdf
from symfric.scenes.mechanism import MechanismScene


@final
@dataclass(frozen=True, eq=False)
class Robot(MechanismScene):
    """The robot of a URDF file, with the law at the friction level of every joint.

    `source` is the path of the file or its text. The normal force of the law is the joint's
    `<dynamics friction>`, or `level` where it has none; the law `relative(LuGre())` breaks away
    there. `<dynamics damping>` is added. See `read_urdf` for names, inputs and limits.
    """

    t_end: ClassVar[float] = 2.0

    source: str | Path
    level: Scalar = param(
        0.0,
        unit="N m",
        role="load",
        doc="friction of joints without a tag; [N] where they slide",
        lower=0.0,
    )
    g: Scalar = param(9.81, unit="m/s^2", role="gravity", doc="gravity", lower=0.0)

    def mechanism(self) -> Mechanism:
        """Bodies, joints and motors."""
        gravity = (0.0, 0.0, -self.g)
        return read_urdf(self.source, law=self.law, level=self.level, gravity=gravity)
