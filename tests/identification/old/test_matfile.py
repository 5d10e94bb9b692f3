"""MATLAB files beside SciPy, and bytes that somebody damaged."""

from io import BytesIO
from typing import Any

import numpy as np
import pytest

from identification.old.matfile import variables

io: Any = pytest.importorskip("scipy.io")
X = np.linspace(0.0, 1.0, 7)
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


@pytest.mark.parametrize("options", [{}, {"do_compression": True}, {"format": "4"}])
def test_numbers_are_those_of_scipy(options: dict[str, Any]) -> None:
    content = dict(EVERY)
    if options.get("format"):
        content = {name: np.asarray(x, dtype=float) for name, x in EVERY.items()}
    file = saved(content, **options)
    found, expected = variables(file), io.loadmat(BytesIO(file))
    assert set(found) == set(content)
    for name, value in found.items():
        assert not isinstance(value, str)
        assert value.shape == expected[name].shape
        np.testing.assert_array_equal(value, expected[name])


def test_what_is_no_number_is_told_in_words() -> None:
    cell = np.empty(2, dtype=object)
    cell[:] = [1.0, "a"]
    found = variables(saved({"t": "text", "s": {"a": 1.0}, "c": cell, "z": 1j * X}))
    words = {"t": "text", "s": "a struct", "c": "a cell array", "z": "a matrix of complex numbers"}
    assert found == words


def test_numbers_in_the_other_order_of_bytes() -> None:
    """A file from a machine of the other endianness, by hand."""

    def element(kind: int, data: bytes) -> bytes:
        return np.array([kind, len(data)], ">u4").tobytes() + data + bytes(-len(data) % 8)

    inner = element(6, np.array([6, 0], ">u4").tobytes())
    inner += element(5, np.array([1, 3], ">i4").tobytes()) + element(1, b"x")
    inner += element(9, np.array([1.0, 2.0, 4.0], ">f8").tobytes())
    file = b"MATLAB 5.0".ljust(124) + b"\x01\x00MI" + element(14, inner)
    assert np.asarray(variables(file)["x"]).tolist() == [[1.0, 2.0, 4.0]]


def test_damaged_bytes_are_a_sentence_and_never_a_crash() -> None:
    """Guards a reader that dies of a segmentation fault, or of any error but these."""
    rng, told = np.random.default_rng(0), 0
    for options in ({}, {"do_compression": True}, {"format": "4"}):
        whole = saved({"t": X, "x": X, "force": X}, **options)
        for _ in range(300):
            bad = bytearray(whole)
            for place in rng.integers(0, len(bad), 12):
                bad[place] = rng.integers(0, 256)
            cut = bytes(bad[: rng.integers(1, len(bad) + 1)])
            try:
                variables(cut)
            except (ValueError, NotImplementedError):
                told += 1
    assert told > 700
