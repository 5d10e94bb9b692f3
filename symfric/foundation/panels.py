"""Empty panels with a light grid, and figures written whole."""

from pathlib import Path

import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from symfric.foundation import checks
from symfric.foundation.files import written


def save(figure: Figure, path: str | Path | None) -> Figure:
    """Write `figure` to `path`, if given, and close it; return it either way."""
    if path is not None:
        known = sorted(figure.canvas.get_supported_filetypes())
        place = checks.path("picture", path)
        ending = place.suffix.removeprefix(".").lower()
        checks.check_names(f"picture '{path}': ending", [ending], known)
        with written(place) as temporary:
            figure.savefig(temporary, dpi=150)
        plt.close(figure)
    return figure


def panels(
    count: int, width: float = 7.0, height: float = 1.9, shared: bool = True
) -> tuple[Figure, list[Axes]]:
    """`count` panels under each other with a light grid, their abscissa shared by default."""
    figure, axes = plt.subplots(
        count, 1, sharex=shared, squeeze=False, figsize=(width, 0.7 + height * count)
    )
    figure.set_layout_engine("constrained")
    for row in axes[:, 0]:
        row.grid(alpha=0.3)
    return figure, list(axes[:, 0])
