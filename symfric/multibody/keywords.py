"""Keywords of the parts of a mechanism."""

from dataclasses import fields
from typing import Any, Self

HINTS = {
    "axis": "the axis of a joint is the z axis of both frames, m.frame('arm.pin', z=(0, 1, 0))",
    "friction": "friction acts in joints, such as Revolute(..., friction=JointFriction(law))",
    "damping": "damping is a part of its own, m.force(JointSpringDamper(...))",
}
"""What to do instead of giving a keyword that other tools have."""


class Keywords:
    """A dataclass that answers an unknown keyword with those that it has."""

    def __new__(cls, *_: object, **given: object) -> Self:
        """Refuse unknown keywords.

        Raises:
            ValueError: a keyword that is not a field.
        """
        kind: Any = cls
        known = [item.name for item in fields(kind) if item.init]
        if wrong := [name for name in given if name not in known]:
            hints = "".join(f"; {HINTS[name]}" for name in wrong if name in HINTS)
            raise ValueError(
                f"{cls.__name__}: expected {', '.join(known)}, got {', '.join(wrong)}{hints}"
            )
        return super().__new__(cls)
