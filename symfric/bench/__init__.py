"""Benchmarks of run time and error; may import every other package."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from symfric.bench.report import Progress, Report

PICTURES = ("integrator", "multibody", "ivp", "regularisation", "ocp", "identification")
"""Subjects with a picture."""
TABLES = ("codegen", "calls", "dynamics", "ensemble", "embedded", "interop", "starts")
"""Subjects without a picture."""
SUBJECTS = (*PICTURES, *TABLES)
"""Names of modules of this package that have a function `bench`."""


def measure(
    subject: str, quick: bool = False, progress: "Progress" = None, **more: Any
) -> "Report":
    """Measure one of `SUBJECTS` on this machine; Ctrl-C returns the rows so far.

    Args:
        subject: name of the subject.
        quick: measure fewer points and fewer other tools.
        progress: called with the current item and the fraction done.
        more: options of the subject, such as `links` of "multibody".
    """
    return import_module(f"symfric.bench.{subject}").bench(quick, progress=progress, **more)
