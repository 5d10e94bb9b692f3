"""Plot of the current motion while `solve` runs."""

import sys
from time import perf_counter
from typing import Any, final

from ocp.solving.watch import Progress
from symfric.foundation import checks
from symfric.foundation.panels import panels
from symfric.foundation.parameters import check_names

SHOWN = 4
"""Number of signals that are shown by default."""


@final
class LivePlot:
    """Plot that is redrawn while `solve(problem, progress=LivePlot("x", "force"))` runs.

    A notebook updates the figure of the cell; elsewhere a window opens if the backend of Matplotlib
    has windows. `figure` is the last plot in all cases.
    """

    def __init__(self, *names: str, every: float = 0.5) -> None:
        """Create the plot.

        Args:
            names: signals to show; by default the first four.
            every: shortest time between two plots [s]; drawing takes about 0.1 s.
        """
        self.names, self.every = names, checks.number("LivePlot: every", every, lower=0.0, unit="s")
        self.figure: Any = None
        self._axes: list[Any] = []
        self._handle: Any = None
        self._next = 0.0

    def __call__(self, now: Progress) -> None:
        """Draw the motion of the iterate, with cost and violation in the title."""
        if perf_counter() < self._next:
            return
        motion = now.motion
        check_names("LivePlot", self.names, motion.signals)
        shown = self.names or [*motion.signals][:SHOWN]
        if self.figure is None:
            self.figure, self._axes = panels(len(shown))
            self._axes[-1].set_xlabel("t [s]")
        for axis, name in zip(self._axes, shown, strict=True):
            for line in [*axis.lines]:
                line.remove()
            style = "steps-post" if name in motion.controls else "default"
            axis.plot(motion.t, motion[name], color="C0", linewidth=1.2, drawstyle=style)
            axis.set_ylabel(f"{name} [{motion.units[name]}]")
        where = f"{now.stage}, iteration {now.iteration}"
        self._axes[0].set_title(f"{where}: J = {now.cost:.5g}, violation {now.violation:.1g}")
        self._show()
        self._next = perf_counter() + self.every

    def _show(self) -> None:
        """Show the figure in the notebook or in its window."""
        shell: Any = sys.modules.get("IPython")
        if shell is not None and shell.get_ipython() is not None:
            if self._handle is None:
                self._handle = shell.display.display(self.figure, display_id=True)
            else:
                self._handle.update(self.figure)
        elif self.figure.has_window():
            self.figure.canvas.manager.show()
            self.figure.canvas.draw_idle()
            self.figure.canvas.flush_events()
