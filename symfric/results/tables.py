"""Runs as tables of pandas and data sets of xarray, where these are installed."""

from collections.abc import Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from symfric.results.trajectory import Trajectory

Array = NDArray[np.float64]


def columns(run: "Trajectory", names: Sequence[str]) -> dict[str, Array]:
    """Signals and details by name; all signals if none is named."""
    run.check(names)
    return {name: run[name] for name in names} if names else dict(run.signals)


def dataframe(run: "Trajectory", names: Sequence[str]) -> Any:
    """A `pandas.DataFrame` with the times as index; units stand in its `attrs`."""
    pandas = module("to_dataframe", "pandas")
    values = columns(run, names)
    frame = pandas.DataFrame(values, index=pandas.Index(run.t, name="t"))
    frame.attrs.update(_about(run) | {"units": {"t": "s"} | {n: run.unit(n) for n in values}})
    return frame


def dataset(run: "Trajectory", names: Sequence[str]) -> Any:
    """An `xarray.Dataset` over the coordinate t; every signal has its unit as an attribute."""
    xarray = module("to_xarray", "xarray")
    values = columns(run, names)
    arrays = {n: ("t", v, {"units": run.unit(n)}) for n, v in values.items()}
    return xarray.Dataset(arrays, coords={"t": ("t", run.t, {"units": "s"})}, attrs=_about(run))


def _about(run: "Trajectory") -> dict[str, str]:
    return {"scene": run.scene, "status": run.status.name, "message": run.message}


def module(where: str, name: str) -> Any:
    """A package that may be missing.

    Raises:
        ImportError: it is, and what to do.
    """
    try:
        return import_module(name)
    except ImportError:
        raise ImportError(
            f"{where}: expected the package {name}, got none; install it by 'pip install {name}', "
            "or take to_csv, which needs nothing"
        ) from None
