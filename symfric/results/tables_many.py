"""Ensembles as tables: a row for each member and time, what was varied beside the signals."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from symfric.foundation import checks
from symfric.results.tables import module

if TYPE_CHECKING:
    from symfric.results.ensemble import Ensemble

Array = NDArray[np.float64]


def chosen(study: "Ensemble", names: Sequence[str]) -> list[str]:
    """The signals that are named; all if none is."""
    checks.check_names(f"ensemble of '{study.scene}'", names, study.signals)
    return list(names) or list(study.signals)


def columns(study: "Ensemble", names: Sequence[str]) -> dict[str, Array]:
    """Times, what was varied and signals, by name; shape (members, times), broadcast."""
    wanted = chosen(study, names)
    shape = (len(study), study.t.shape[-1])
    found = {"t": np.broadcast_to(study.t, shape)}
    found |= {n: np.broadcast_to(v[:, None], shape) for n, v in study.varied.items()}
    return found | {name: study.signals[name] for name in wanted}


def units(study: "Ensemble", names: Iterable[str]) -> dict[str, str]:
    """Name -> unit."""
    return {name: "s" if name == "t" else study.unit(name) for name in names}


def by_member(study: "Ensemble", held: Mapping[str, Array]) -> Iterator[Array]:
    """The rows of each member, shape (times, columns)."""
    for m in range(len(study)):
        yield np.column_stack([values[m] for values in held.values()])


def dataframe(study: "Ensemble", names: Sequence[str]) -> Any:
    """A `pandas.DataFrame` with the index (member, t), or member where there are ends alone."""
    pandas = module("to_dataframe", "pandas")
    held = columns(study, names)
    flat = {name: values.ravel() for name, values in held.items()}
    members = np.arange(len(study))
    if study.t.shape[-1] == 1:
        index = pandas.Index(members, name="member")
        if study.t.ndim == 1:
            del flat["t"]
    else:
        del flat["t"]
        index = pandas.MultiIndex.from_product([members, study.t], names=["member", "t"])
    frame = pandas.DataFrame(flat, index=index)
    frame.attrs.update(about(study) | {"units": units(study, held)})
    return frame


def dataset(study: "Ensemble", names: Sequence[str]) -> Any:
    """An `xarray.Dataset` over member and t."""
    xarray = module("to_xarray", "xarray")
    over_t = study.t.ndim == 1
    coordinates: dict[str, Any] = {"member": np.arange(len(study))}
    unit = {"units": "s"}
    coordinates["t"] = ("t", study.t, unit) if over_t else ("member", study.t[:, 0], unit)
    for name, values in study.varied.items():
        coordinates[name] = ("member", values, {"units": study.unit(name)})
    arrays = {
        name: (("member", "t"), study.signals[name], {"units": study.units[name]})
        if over_t
        else ("member", study.signals[name][:, 0], {"units": study.units[name]})
        for name in chosen(study, names)
    }
    return xarray.Dataset(arrays, coords=coordinates, attrs=about(study))


def about(study: "Ensemble") -> dict[str, Any]:
    """Scene, how it ended, and numbers that all members share."""
    return {"scene": study.scene, "status": study.status.name, **study.fixed}
