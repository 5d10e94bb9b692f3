"""The end of a fit as arrays: what tests and intervals are made of."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from identification.residuals.evaluation import Array, Channel
from identification.unknowns.unknown import Unknown


@final
@dataclass(frozen=True, eq=False)
class Minimum:
    """A minimum of weighted least squares over n coordinates w, with k values that depend on them.

    Attributes:
        channels: what the rows are.
        unknowns: what has a coordinate, shape (n,).
        names, values: of what the residuals take, shape (k,).
        slope: dvalues/dw, shape (k, n).
        held: coordinates at a bound, shape (n,).
        r: weighted residuals, with a robust loss its influence function of them, shape (rows,).
        J: dr/dw of the weighted residuals before the loss, shape (rows, n).
        gain: derivative of the influence function; one for squares, shape (rows,).
        raw: predicted - measured in SI units, shape (rows,).
        noise: standard deviation of the noise of signals for which it is known.
    """

    channels: Sequence[Channel]
    unknowns: tuple[Unknown, ...]
    names: tuple[str, ...]
    values: Array
    slope: Array
    held: NDArray[np.bool_]
    r: Array
    J: Array
    gain: Array
    raw: Array
    noise: Mapping[str, float]

    def label(self, channel: Channel) -> str:
        """Name of a channel for a sentence."""
        records = {c.record for c in self.channels}
        return channel.signal if len(records) == 1 else f"{channel.signal}[{channel.record}]"
