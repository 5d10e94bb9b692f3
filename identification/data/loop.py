"""The position controller of a drive experiment, as far as it is data."""

from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from symfric.foundation import checks
from symfric.foundation.brief import brief

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class PositionLoop:
    """A sampled cascade of position and velocity feedback with its reference.

        command = clip(kp kv (reference - x) - kv dx, +-limit)
        force = gain (command + disturbance)

    dx is the difference of the mean of the last two positions. The command is held for one sample.

    Attributes:
        kp: position gain [1/s].
        kv: velocity gain [command s/m].
        gain: force per command [N per command unit].
        limit: largest command.
        reference: position reference at the samples [m], shape (n,).
        disturbance: added to the command, shape (n,).

    Raises:
        ValueError: numbers that are not finite, series of different lengths.
    """

    kp: float
    kv: float
    gain: float
    limit: float
    reference: Array
    disturbance: Array

    __repr__ = brief

    def __post_init__(self) -> None:
        for key in ("kp", "kv", "gain"):
            object.__setattr__(self, key, checks.number(f"PositionLoop: {key}", getattr(self, key)))
        limit = checks.number("PositionLoop: limit", self.limit, above=0.0)
        object.__setattr__(self, "limit", limit)
        for key in ("reference", "disturbance"):
            object.__setattr__(self, key, checks.array(f"PositionLoop: {key}", getattr(self, key)))
        if self.reference.shape != self.disturbance.shape:
            raise ValueError(
                "PositionLoop: expected reference and disturbance of one length, got "
                f"{self.reference.size} and {self.disturbance.size}"
            )

    def between(self, first: int, end: int) -> "PositionLoop":
        """The controller over the samples `first` to `end` (not included)."""
        cut = slice(first, end)
        return PositionLoop(
            self.kp, self.kv, self.gain, self.limit, self.reference[cut], self.disturbance[cut]
        )
