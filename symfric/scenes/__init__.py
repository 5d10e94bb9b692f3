"""Ready machines: each takes any friction law and gives a `Model`."""

from collections.abc import Iterable

from symfric.laws import Law
from symfric.model import Model
from symfric.numeric import Scalar
from symfric.parameters import with_values
from symfric.scenes.base import Scene as Scene
from symfric.scenes.base import friction_states as friction_states
from symfric.scenes.drive import Drive as Drive
from symfric.scenes.rabinowicz import Rabinowicz as Rabinowicz

ALL_SCENES: dict[str, type[Scene]] = {"rabinowicz": Rabinowicz, "drive": Drive}
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
