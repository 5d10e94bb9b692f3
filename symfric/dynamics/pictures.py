"""Pictures of the long-run behaviour of machines."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from symfric.foundation.numeric import Array
from symfric.foundation.panels import panels, save
from symfric.foundation.style import line


def bode(
    frequencies: Array, G: NDArray[np.complex128], names: Sequence[Sequence[str]],
    path: str | Path | None,
) -> Figure:  # fmt: skip
    """Plot magnitude and phase of a frequency response.

    Args:
        frequencies: w [rad/s], shape (m,).
        G: response, shape (m, outputs, inputs).
        names: legend entries, by output and input.
        path: image file.
    """
    figure, (size, angle) = panels(2, width=6.0)
    for i, row in enumerate(names):
        for j, name in enumerate(row):
            look = line(i, j)
            size.loglog(frequencies, np.abs(G[:, i, j]), label=name, linewidth=1.4, **look)
            phase = np.degrees(np.unwrap(np.angle(G[:, i, j])))
            angle.semilogx(frequencies, phase, linewidth=1.4, **look)
    size.set_ylabel("magnitude")
    angle.set_ylabel("phase [deg]")
    angle.set_xlabel("frequency [rad/s]")
    size.legend(frameon=False, fontsize="small")
    return save(figure, path)
