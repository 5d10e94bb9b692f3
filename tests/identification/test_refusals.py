"""Bad calls are refused in one sentence; `refusals.txt` lists the calls and the sentences."""

from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from crane import log as crane_log
from crane import urdf
from recorders import GERMAN, Frame, lively, pair
from scipy import io

import identification
import symfric
from identification.data.dataset import Dataset
from identification.data.differentiate import Velocity
from identification.data.record import Record
from identification.data.units import by_channel
from identification.fit import Fit
from identification.residuals.closed_loop import ClosedLoop
from identification.residuals.initial import cut
from identification.residuals.inverse import InverseDynamics
from identification.residuals.points import Points
from identification.residuals.shooting import Shooting, choose
from identification.residuals.shots import sampled_motion
from identification.result.fitted import Fitted
from identification.result.stored import from_data, plain
from identification.unknowns.subject import subject
from identification.unknowns.unknowns import unknowns_of
from symfric.scenes import Drive

FILE = Path(__file__).with_name("refusals.txt")
T = np.arange(200) / 100
DATA = Dataset.of(t=T, x=np.sin(5 * T), force=np.cos(T))
HOLED = np.delete(np.arange(200), slice(80, 130))
V = np.linspace(-0.1, 0.1, 60)
POINTS = Dataset.of(v=V, F=np.sign(V) * 2 + V, points=True)
HEADER = "t [s],x [m],force [N]"
ROWS = [f"{t!r},{5 * t!r},1" for t in T[:100].tolist()]
TABLE = np.column_stack([T, np.sin(T), np.cos(T)])
RUN = {"t": T, "x": np.sin(T), "force": np.cos(T)}
FIRST, SECOND = pair(lively(0), 0.1)
FREE = ("m", "mu_d", "sigma_2")
AXIS = symfric.Drive(torque_constant=0.12, gear_ratio=2.0, lead=5e-3, counts_per_turn=65536)
DRIVE = Drive(symfric.Stribeck(mu_s=6.0, mu_d=4.0, v_s=0.1, sigma_2=8.0), m=2.0, N=1.0)
NAMES: dict[str, Any] = {
    **vars(symfric.laws), **{n: getattr(symfric, n) for n in symfric.__all__},
    **{n: getattr(identification, n) for n in identification.__all__},
    "np": np, "T": T, "DATA": DATA, "POINTS": POINTS, "HEADER": HEADER, "ROWS": ROWS, "RUN": RUN,
    "LATER": Dataset.of(t=T + 10.0, x=np.sin(T), force=np.cos(T), name="later"),
    "TURNS": Dataset.of(t=T, x=T, force=T, units="rad, N m"),
    "GAPPY": Dataset.of(t=T[HOLED], x=np.sin(T[HOLED]), force=np.cos(T[HOLED])),
    "UNEVEN": Dataset.of(t=T**1.1, x=np.sin(T), force=np.cos(T)),
    "ONE_WAY": Dataset.of(v=np.abs(V) + 0.01, F=V, points=True),
    "OVER_TIME": Dataset.of(t=T, v=T, F=T, units={"v": "m/s", "F": "N"}),
    "FIRST": FIRST, "SECOND": SECOND, "MATRIX": TABLE, "SPEEDS": np.linspace(0.01, 1.0, 20),
    "TWO": np.array([tuple(RUN.values())] * 2, dtype=[(n, object) for n in RUN]),
    "MODES": "t [s],theta_2 [deg],mode\n0,0,auto\n1,1,1\n2,2,1\n", "FREE": FREE, "DRIVE": DRIVE,
    "Drive": Drive, "Frame": Frame, "GERMAN": GERMAN,
    "NAMES": {"t": "Zeit", "x": "Winkel", "force": "Moment"},
    "TWICE": f"{HEADER}\n0,0,1\n1,1,2\n1,1,2\n2,1,2\n3,4,5\n", "MODEL": DRIVE.model(free=FREE),
    "AXIS": AXIS, "crane_log": crane_log, "urdf": urdf,
    "Velocity": Velocity, "by_channel": by_channel, "cut": cut, "choose": choose, "plain": plain,
    "subject": subject, "from_data": from_data, "replace": replace, "SX": ca.SX,
}  # fmt: skip


def saved(content: dict[str, Any]) -> bytes:
    io.savemat(file := BytesIO(), content)
    return file.getvalue()


def controller(measured: int = 1) -> ca.Function:
    s, x, r = ca.SX.sym("s", 2), ca.SX.sym("x", measured), ca.SX.sym("r")
    return ca.Function("controller", [s, x, r], [s, r])


def loop(law: Any, data: Dataset = DATA) -> object:
    return ClosedLoop().prepare(subject(law), data)


def inverse(data: Dataset, **how: Any) -> object:
    return InverseDynamics(**how).prepare(subject(DRIVE), data)


def curve(law: Any, data: Dataset, **how: Any) -> object:
    one = subject(law, points=True, moving=True)
    return Points(**how).prepare(one, data)


def shots(data: Dataset = DATA, law: Any = DRIVE, **how: Any) -> object:
    return Shooting(**how).prepare(subject(law, free=["m"], fixed="others"), data, {})


def motion_of(model: Any) -> object:
    return sampled_motion(model, np.arange(3.0), np.zeros(3), np.zeros(0), np.zeros(2))


def fit(**given: Any) -> Fitted:
    return Fit(**{"kind": Points(), "what": "stribeck", "data": POINTS, **given}).solve()


def unknowns(what: Any, **given: Any) -> object:
    found = subject(what, **given)
    return unknowns_of(found.unknowns, found.ties, found.names, found.held)


def drive_log(columns: dict[str, Any], units: Any = None, **changes: Any) -> Dataset:
    return Dataset.of({"t [s]": T, **columns}, drive=replace(AXIS, **changes), units=units)


def crane(change: Any) -> Dataset:
    record = crane_log(duration=4.0)[0]
    changed = {name: change(name, record[name]) for name in record.signals}
    return crane_log(duration=4.0, **changed)


def log(t: Any, x: Any) -> Record:
    return Record("log", t, {"x": x}, {"x": "m"}, first_row=7)


OWN = (
    saved,
    controller,
    loop,
    inverse,
    curve,
    shots,
    motion_of,
    fit,
    unknowns,
    log,
    drive_log,
    crane,
)


@pytest.fixture
def names(tmp_path: Path) -> dict[str, Any]:
    """The names of the table, with functions that write and read files in an empty folder."""

    def raw(content: str | bytes, name: str = "log.csv", **how: Any) -> Dataset:
        (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
        return Dataset.read(tmp_path / name, **how)

    def text(header: str, row: str | None = None, **how: Any) -> Dataset:
        lines = [*ROWS[:5], ROWS[5] if row is None else row, *ROWS[6:]]
        return raw("\n".join([header, *lines]), **how)

    def mat(content: dict[str, Any], **how: Any) -> Dataset:
        return raw(saved(content), "log.mat", units="m, N", **how)

    def stored(content: str | None) -> Fitted:
        if content is not None:
            (tmp_path / "other.json").write_text(content)
        return Fitted.from_json(tmp_path / "other.json")

    own = {function.__name__: function for function in (*OWN, raw, text, mat, stored)}
    return NAMES | own | {"FOLDER": tmp_path}


PARTS = [part.splitlines() for part in FILE.read_text("utf-8").split("\n[")[1:]]


@pytest.mark.parametrize("part", PARTS, ids=lambda part: part[0].rstrip("]"))
def test_bad_calls_are_refused(part: list[str], names: dict[str, Any]) -> None:
    for line in filter(None, part[1:]):
        call, message = line.split(" => ")
        with pytest.raises(ValueError, match=f"(?s){message}"):
            eval(call, names)
            pytest.fail(f"accepted: {call}")
