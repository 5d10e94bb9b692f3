"""MATLAB and NumPy files compared with SciPy, the EMPS benchmark, and damaged files."""

from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from identification.data.dataset import Dataset
from identification.data.mat_file import variables

io: Any = pytest.importorskip("scipy.io")
T = np.arange(100) / 100
X = np.linspace(0.0, 1.0, 7)
RUN = {"t": T, "x": np.sin(T), "force": np.cos(T)}
LOG = {"time": T, "q": np.sin(T), "tau": np.cos(T)}
MATRIX = np.column_stack(list(RUN.values()))
NAMES = ["t", "x", "force"]
EVERY = {
    "row": X,
    "column": X[:, None],
    "matrix": np.arange(6.0).reshape(2, 3),
    "one": 3.5,
    "whole": np.arange(300),  # stored in fewer bytes by some writers
    **{f"x_{kind}": (X * 100).astype(kind) for kind in ("f4", "i1", "u1", "i2", "u2", "i4", "u4")},
}


def saved(content: dict[str, Any], **options: Any) -> bytes:
    file = BytesIO()
    io.savemat(file, content, **options)
    return file.getvalue()


def read(folder: Path, content: dict[str, Any] | bytes, **options: Any) -> Dataset:
    raw = content if isinstance(content, bytes) else saved(content)
    (folder / "log.mat").write_bytes(raw)
    return Dataset.read(folder / "log.mat", **{"units": "m, N", **options})


def structs(*fields: str, rows: list[tuple[Any, ...]]) -> Any:
    return np.array(rows, dtype=[(field, object) for field in fields])


TWO = structs(*NAMES, rows=[tuple(RUN.values()), tuple(v[:50] for v in RUN.values())])
SIGNALS = structs("values", "label", rows=[(np.sin(T), "x"), (np.cos(T), "torque")])
FORMS: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "variables": ({**RUN, "Ts": 0.01, "note": "rig 3"}, {}),
    "struct": ({"run": {**LOG, "note": "rig 3"}}, {}),
    "struct in a struct": ({"exp": {"meta": {"date": "May"}, "log": LOG}}, {}),
    "one of several structs": ({"a": {"b": LOG}, "c": MATRIX}, {"variable": "a.b"}),
    "matrix": ({"data": MATRIX}, {"columns": NAMES}),
    "matrix on its side": ({"data": MATRIX.T}, {"columns": NAMES}),
    "matrix by its path": ({"s": {"data": MATRIX}}, {"columns": NAMES, "variable": "s.data"}),
    "matrix without time": ({"d": MATRIX[:, 1:]}, {"columns": ["x", "force"], "step": 0.01}),
    "Simulink log": ({"ScopeData": {"time": T, "signals": SIGNALS, "blockName": "m/S"}}, {}),
    "one of a vector of structs": ({"runs": TWO}, {"variable": "runs(1)"}),
}


@pytest.mark.parametrize("form", FORMS)
def test_forms_give_the_same_record(tmp_path: Path, form: str) -> None:
    content, options = FORMS[form]
    data = read(tmp_path, content, **options)
    assert len(data) == 1
    np.testing.assert_allclose(data[0].time, T, atol=1e-15)
    np.testing.assert_array_equal(data[0]["x"], np.sin(T))
    np.testing.assert_array_equal(data[0]["force"], np.cos(T))


def test_vectors_of_structs_and_equal_structs_are_several_records(tmp_path: Path) -> None:
    cells = np.empty(2, dtype=object)
    cells[:] = [MATRIX, MATRIX[:50]]
    for content, options in (
        ({"runs": TWO}, {}),
        ({"run1": RUN, "run2": {k: v[:50] for k, v in RUN.items()}}, {}),
        ({"runs": cells}, {"columns": NAMES}),
    ):
        assert [record.size for record in read(tmp_path, content, **options)] == [100, 50]


def test_numpy_files(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", **RUN)
    np.save(tmp_path / "b.npy", MATRIX)
    rows = np.array(list(map(tuple, MATRIX)), dtype=[(name, "f8") for name in NAMES])
    np.save(tmp_path / "c.npy", rows)
    for name, options in (("a.npz", {}), ("b.npy", {"columns": NAMES}), ("c.npy", {})):
        data = Dataset.read(tmp_path / name, units="m, N", **options)
        np.testing.assert_array_equal(data[0]["force"], np.cos(T))


def test_emps_files_bring_their_controller(emps_files: Dataset) -> None:
    plain, pulses = emps_files
    assert (plain.size, plain.unit("x"), plain.unit("force")) == (24841, "m", "N")
    assert (plain.loop.kp, plain.loop.kv, plain.loop.limit) == (160.18, 243.45, 10.0)
    assert not plain.loop.disturbance.any() and pulses.loop.disturbance.any()
    command = plain.loop.kp * plain.loop.kv * (plain.loop.reference - plain["x"])
    assert np.corrcoef(command, plain["force"])[0, 1] > 0.3  # reference and position belong


@pytest.mark.parametrize("options", [{}, {"do_compression": True}, {"format": "4"}])
def test_numbers_are_those_of_scipy(options: dict[str, Any]) -> None:
    content = dict(EVERY)
    if options.get("format"):
        content = {name: np.asarray(x, dtype=float) for name, x in EVERY.items()}
    file = saved(content, **options)
    found, expected = variables(file), io.loadmat(BytesIO(file))
    assert set(found) == set(content)
    for name, value in found.items():
        assert value.shape == expected[name].shape
        np.testing.assert_array_equal(value, expected[name])


def test_structs_cells_and_texts() -> None:
    cell = np.empty(2, dtype=object)
    cell[:] = [np.array([1.0, 2.0]), "a"]
    found = variables(
        saved({"t": "text", "s": {"a": 1.0, "b": {"c": "µm"}}, "c": cell, "z": 1j * X})
    )
    assert (found["t"], found["s"]["b"], found["c"][1]) == ("text", {"c": "µm"}, "a")
    assert found["s"]["a"].item() == 1.0
    assert found["z"] == "a matrix of complex numbers"


def test_numbers_in_the_other_order_of_bytes() -> None:
    """A file from a machine of the other endianness, by hand."""

    def element(kind: int, data: bytes) -> bytes:
        return np.array([kind, len(data)], ">u4").tobytes() + data + bytes(-len(data) % 8)

    inner = element(6, np.array([6, 0], ">u4").tobytes())
    inner += element(5, np.array([1, 3], ">i4").tobytes()) + element(1, b"x")
    inner += element(9, np.array([1.0, 2.0, 4.0], ">f8").tobytes())
    file = b"MATLAB 5.0".ljust(124) + b"\x01\x00MI" + element(14, inner)
    assert np.asarray(variables(file)["x"]).tolist() == [[1.0, 2.0, 4.0]]


def test_damaged_bytes_are_a_sentence_and_never_a_crash(tmp_path: Path) -> None:
    """Guards a reader that dies of a segmentation fault (as SciPy's), or of any other error."""
    rng, refused = np.random.default_rng(0), 0
    short = {key: value[:7] for key, value in RUN.items()}
    nested = {"runs": structs(*NAMES, rows=[tuple(short.values())] * 2), "note": "rig"}
    for content, options in (
        (short, {}),
        (short, {"do_compression": True}),
        (short, {"format": "4"}),
        (nested, {}),
    ):
        whole = saved(content, **options)
        for _ in range(25):
            bad = bytearray(whole)
            for place in rng.integers(0, len(bad), 8):
                bad[place] = rng.integers(0, 256)
            try:
                read(tmp_path, bytes(bad[: rng.integers(1, len(bad) + 1)]))
            except ValueError:
                refused += 1
    assert refused > 60
