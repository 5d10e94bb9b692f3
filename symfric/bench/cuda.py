"""Ensembles on a graphics processor, beside the same on all cores; where there is one."""

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter
from typing import final
from warnings import catch_warnings, simplefilter

import numpy as np
from numpy.typing import NDArray

from symfric.integrator import Ensemble, simulate_many
from symfric.integrator.cuda import on_device
from symfric.integrator.cuda.device import DeviceError
from symfric.laws import BrownMcPhee, LuGre
from symfric.model import Model
from symfric.scenes import SliderCrank, rabinowicz

Array = NDArray[np.float64]
MEMBERS, SAMPLE = 1_000_000, 2000
Case = tuple[str, Callable[[], Model], str, float, int]
CASES: tuple[Case, ...] = (
    ("rabinowicz/brown_mcphee", lambda: rabinowicz(BrownMcPhee()), "v", 20.0, 1),
    ("rabinowicz/lugre", lambda: rabinowicz(LuGre()), "v", 20.0, 1),
    ("slider_crank/brown_mcphee", lambda: SliderCrank(BrownMcPhee()).model(), "", 1.0, 10),
)
"""Name, model, state whose start value varies, end [s], and by how much there are fewer members."""
TOLERANCES = {"double": 1e-6, "float": 1e-4}


@final
@dataclass(frozen=True)
class CudaRow:
    """An ensemble over a start value on a graphics processor.

    Attributes:
        case: scene and law.
        real: floating point type.
        rtol: of both.
        device: its name; "no GPU" where there is none, and nothing is measured then.
        members: how many.
        first_s: time of a first call for a few members [s]: NVRTC compiles.
        per_second: members a second, whole call.
        cores_per_second: the same of compiled code on all cores, for a sample of the members.
        ratio: per_second over cores_per_second.
        equal: fraction of the sample with the same attempts on both.
        difference: median over the sample of the largest difference of a state at the end, relative
            to the largest one of all members.
        why: why nothing was measured.
    """

    case: str
    real: str
    rtol: float
    device: str = "no GPU"
    members: int = 0
    first_s: float = 0.0
    per_second: float = 0.0
    cores_per_second: float = 0.0
    ratio: float = 0.0
    equal: float = 0.0
    difference: float = 0.0
    why: str = ""


def measure_cuda(*, quick: bool = False) -> tuple[CudaRow, ...]:
    """Rows of all cases in both types; `quick`: of one case, a hundredth of the members."""
    members, cases = MEMBERS // (100 if quick else 1), CASES[:1] if quick else CASES
    return tuple(_row(case, real, members) for case in cases for real in TOLERANCES)


def _row(case: Case, real: str, members: int) -> CudaRow:
    (name, make, state, end, fewer), rtol = case, TOLERANCES[real]
    try:
        device = on_device.find_device().name
    except DeviceError as error:
        return CudaRow(name, real, rtol, why=str(error))
    model, members = make(), members // fewer
    starts = dict(zip((v.name for v in model.x), model.initial_state(None, None), strict=True))
    state = state or next(v.name for v in model.x if v.unit in ("m/s", "rad/s"))
    values = starts[state] + np.linspace(-0.1, 0.1, members)

    def run(x0: Array, backend: str) -> tuple[Ensemble, float]:
        began = perf_counter()
        with catch_warnings():
            simplefilter("ignore", UserWarning)  # that the tolerance of single precision is loose
            found = simulate_many(
                model, end, x0={state: x0}, rtol=rtol, backend=backend,
                real=real if backend == "cuda" else "double",
            )  # fmt: skip
        return found, perf_counter() - began

    picked = np.unique(np.linspace(0, members - 1, SAMPLE).astype(int))
    _, first = run(values[:100], "cuda")
    many, spent = run(values, "cuda")
    run(values[:100], "compiled")
    own, on_cores = run(values[picked], "compiled")
    y, x = (np.column_stack([e[v.name][:, 0] for v in model.x]) for e in (many, own))
    off = (np.abs(y[picked] - x) / (np.abs(x).max(axis=0) + 1e-300)).max(axis=1)
    ours, theirs = members / spent, picked.size / on_cores
    return CudaRow(
        name, real, rtol, device, members, first, ours, theirs, ours / theirs,
        float((many.attempts[picked] == own.attempts).mean()), float(np.median(off)),
    )  # fmt: skip
