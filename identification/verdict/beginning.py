"""Records that begin slowly with residuals far above the rest: states that nobody knew there.

Bristles are taken as relaxed where a record begins near rest. If it was loaded before, the force is
wrong until they have slid once, and stiffness and damping make up for it.
"""

from collections.abc import Iterator

import numpy as np

from identification.residuals.evaluation import Channel
from identification.residuals.imposed import moving_start
from identification.verdict.minimum import Minimum

FIRST = 0.05
"""Share of a record that is its beginning."""
FEWEST = 8
"""Samples below which a beginning is none."""
LARGER = 4.0
"""Residuals of a beginning over the others; of Gauss's, coloured or not, 1 in 10 000 have it."""


def beginnings(found: Minimum) -> Iterator[str]:
    """A sentence for each channel whose record begins with what the model does not know.

    Limits: of records in order of time with a velocity among the regressors. A model that is wrong
    at the beginning for another reason, such as a decay from its largest swing, looks the same.
    """
    for channel in found.channels:
        ratio, count = _ratio(found, channel)
        if ratio > LARGER:
            yield (
                f"The residuals of {found.label(channel)} are {ratio:.2g} times as large in its "
                f"first {count} samples as after: the record begins loaded, or with other states "
                "unknown; begin it in sliding, or unloaded."
            )


def _ratio(found: Minimum, channel: Channel) -> tuple[float, int]:
    """Size of the residuals at the beginning over that of the others, and samples of it."""
    v, r = channel.regressors.get("v"), found.r[channel.rows]
    count = int(FIRST * r.size)
    if v is None or not channel.ordered or count < FEWEST or moving_start(v) != 0.0:
        return 0.0, count
    first, later = (float(np.sqrt(np.mean(part**2))) for part in (r[:count], r[count:]))
    return first / max(later, 1e-300), count
