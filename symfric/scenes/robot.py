"""A robot from a URDF file."""

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, final

from symfric.foundation import checks
from symfric.foundation.numeric import Scalar
from symfric.foundation.parameters import param
from symfric.laws import Law
from symfric.laws.base.law import check_law
from symfric.multibody import Mechanism
from symfric.multibody.urdf.read import read_urdf
from symfric.scenes.mechanism import MechanismScene


@final
@dataclass(frozen=True, eq=False)
class Robot(MechanismScene):
    """The robot of a URDF file, with the law at the friction level of every joint.

    `source` is the path of the file or its text. The normal force of the law is the joint's
    `<dynamics friction>`, or `level` where it has none; the law `relative(LuGre())` breaks away
    there. `<dynamics damping>` is added. See `read_urdf` for names, inputs and limits. `laws` are
    those of the `joints` of these names; their parameters have endings where they share a name.
    """

    t_end: ClassVar[float] = 2.0

    source: str | Path
    joints: tuple[str, ...] = ()
    laws: tuple[Law, ...] = ()
    level: Scalar = param(
        0.0,
        unit="N m",
        role="load",
        doc="friction of joints without a tag; [N] where they slide",
        lower=0.0,
    )
    g: Scalar = param(9.81, unit="m/s^2", role="gravity", doc="gravity", lower=0.0)

    def __post_init__(self) -> None:
        for law in checks.many("Robot: laws", self.laws, "laws"):
            check_law("Robot: laws", law)
        if len(checks.many("Robot: joints", self.joints, "names of joints")) != len(self.laws):
            raise ValueError(
                f"Robot: expected a law for every one of the joints, got {len(self.joints)} joints "
                f"and {len(self.laws)} laws"
            )
        super().__post_init__()

    def mechanism(self) -> Mechanism:
        """Bodies, joints and motors."""
        gravity = (0.0, 0.0, -self.g)
        laws = dict(zip(self.joints, self.laws, strict=True))
        return read_urdf(self.source, law=self.law, laws=laws, level=self.level, gravity=gravity)
