"""Hostile files: damaged, inconsistent and malicious variants of good ones by a seed."""

import json
import random
import warnings
import zipfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from copy import deepcopy
from functools import cache
from io import BytesIO
from threading import get_ident, main_thread
from typing import Any
from unittest.mock import patch

import casadi as ca
import numpy as np

from symfric.foundation import packed

Arrays = dict[str, np.ndarray[Any, Any]]

CLASSES = (
    "os:system", "subprocess:Popen", "casadi:external", "casadi.casadi:Function", "builtins:eval",
    "pathlib:Path", "symfric.foundation.programs:Compiler", "symfric.foundation.files:written",
    "symfric.integrator.compiled.columns:Rows", "symfric.integrator.stored:Stored",
    "symfric.integrator.stored:Basis", "symfric.model.model:Model", "symfric.__main__:main",
    "symfric.laws.dynamic.lugre:LuGre", "symfric.foundation.variable:Variable",
    "symfric.foundation.packed:Given",
    "identification.residuals.shots:delayed", "identification.fit:Fit", "ocp.mpc.session:Session",
    "symfric.foundation.packed:partial", "symfric.results.trajectory:Trajectory",
)  # fmt: skip
"""Names that a file may try to give to its objects: dangerous, forbidden and allowed ones."""

VALUES: tuple[Any, ...] = (
    None, True, -1, 0, 10**30, 2**63, 1e308, "", "x", "*/ system(0); /*", "../../etc/passwd", "\0",
    "a\nb", [], {}, [[]], {"is": "os:system", "has": {}}, {"function": "os:system"},
    {"partial": [{"function": "os:system"}, {"tuple": ["true"]}, {"dict": []}]},
    {"serialized": [ca.Function("f", [], []).serialize(), None]}, {"was": {"dict": []}},
    {"SX": 0}, {"SX": 10**9}, {"DM": -1}, {"array": 0}, {"array": "0"}, {"same": 0}, {"same": -1},
    {"tuple": 3}, {"dict": [[{"dict": []}, 1]]},
    {"enum": ["symfric.foundation.status:Status", "?"]},
    {"Function": ["f", [{"SX": 0}], [{"SX": 1}], ["a"], ["b"]]}, {"Function": ["/etc/passwd"]},
    {"Function": ["f", [], [], [], [], {"dict": [["jit", True], ["compiler", "shell"]]}]},
)  # fmt: skip
NAMES = ("__class__", "__post_init__", "unpacked", "name", "memory")


@cache
def _read(good: bytes) -> tuple[Arrays, bytes]:
    arrays = dict(np.load(BytesIO(good)))
    return arrays, arrays.pop(packed.ABOUT).tobytes()


def contents(good: bytes) -> tuple[Arrays, Any]:
    """The arrays and the JSON of a file."""
    arrays, about = _read(good)
    return dict(arrays), json.loads(about)


def written(arrays: Arrays, about: Any, save: Callable[..., None] = np.savez) -> bytes:
    """The file with these arrays and this JSON, a text or data."""
    text = about if isinstance(about, str) else json.dumps(about)
    buffer = BytesIO()
    save(buffer, **{packed.ABOUT: np.frombuffer(text.encode(), np.uint8)}, **arrays)
    return buffer.getvalue()


def hostile(good: bytes, dice: random.Random) -> bytes:
    """A file that differs from `good` in bytes, members, values, sizes or depth."""
    kinds = (_bytes, _members, _header, _json, _json, _json, _array, _array, _deep)
    return dice.choice(kinds)(good, dice)


def _bytes(good: bytes, dice: random.Random) -> bytes:
    """Flipped, cut, doubled or inserted bytes."""
    k, n = dice.randrange(len(good)), dice.randrange(1, 200)
    noise = dice.randbytes(n)
    return dice.choice((good[:k], good[:k] + noise + good[k + n :], good[:k] + noise + good[k:],
                        good[:k] + good[max(0, k - n) :], noise))  # fmt: skip


def _members(good: bytes, dice: random.Random) -> bytes:
    """Members that are compressed, missing or foreign."""
    arrays, about = contents(good)
    name = dice.choice([*arrays])
    return dice.choice((
        lambda: written(arrays | {"zeros": np.zeros(10**7, np.uint8)}, about, np.savez_compressed),
        lambda: written({k: v for k, v in arrays.items() if k != name}, about),
        lambda: written(arrays | {name + "x": np.array(["text"]), "s": np.zeros(3)}, about),
    ))()  # fmt: skip


def _header(good: bytes, dice: random.Random) -> bytes:
    """A member that is repeated, or larger than it is."""
    name, twice = dice.choice([packed.ABOUT, *contents(good)[0]]), dice.random() < 0.5
    buffer = BytesIO()
    with zipfile.ZipFile(BytesIO(good)) as old, zipfile.ZipFile(buffer, "w") as new:
        for member in old.infolist():
            data = old.read(member)
            if member.filename == f"{name}.npy":
                end = data.index(b"\n")
                sizes = ("(9223372036854775807,)", "(1099511627776, 0)", "(-1,)", "(2,)")
                kind = dice.choice(("|O", "<f8", "|V8", "<U0", "<c16", "|u1"))
                text = f"'descr': '{kind}', 'fortran_order': False, 'shape': {dice.choice(sizes)}"
                text = f"{{{text}, }}".ljust(end - 10)[: end - 10]
                data = data[:10] + text.encode() + data[end:]
            with warnings.catch_warnings(action="ignore"):
                for _ in range(1 + twice):
                    new.writestr(member, data)
    return buffer.getvalue()


def _places(data: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Paths to all values in JSON."""
    yield path
    items = (
        data.items() if isinstance(data, dict) else enumerate(data if type(data) is list else ())
    )
    for key, value in items:
        yield from _places(value, (*path, key))


def _json(good: bytes, dice: random.Random) -> bytes:
    """Other values, names and classes; fields too many or too few."""
    arrays, about = contents(good)
    for _ in range(dice.choice((1, 1, 3))):
        *way, last = dice.choice([place for place in _places(about) if place])
        held = about
        for key in way:
            held = held[key]
        kind = dice.randrange(4) if isinstance(held, dict) else 3
        if kind == 0:
            del held[last]
        elif kind == 1:
            held[dice.choice(NAMES)] = 1
        else:
            held[last] = dice.choice(CLASSES) if last == "is" else deepcopy(dice.choice(VALUES))
    return written(arrays, about)


def _array(good: bytes, dice: random.Random) -> bytes:
    """An array of other numbers, shape or kind: also of instructions and their operands."""
    arrays, about = contents(good)
    name = dice.choice([*arrays])
    array = arrays[name]
    if dice.random() < 0.5 and array.size and array.dtype.kind in "if":
        numbers = (-1, 0, 10**12, 2**62, np.nan, np.inf, 1e300)
        array = array.copy()
        array.flat[dice.randrange(array.size)] = dice.choice(
            numbers[:4] if array.dtype.kind == "i" else numbers
        )
    else:
        array = dice.choice((
            array[:0], array.reshape(-1), array[None], np.concatenate([array, array]),
            array.astype(str), np.zeros((0, 3)), np.array(1.0), np.zeros((5, 0, 2), np.int64),
        ))  # fmt: skip
    return written(arrays | {name: array}, about)


def _deep(good: bytes, dice: random.Random) -> bytes:
    """JSON or expressions nested a hundred thousand times."""
    arrays, about = contents(good)
    if dice.random() < 0.5:
        nest = dice.choice(("[", '{"tuple":', '{"was":', '{"is":"symfric.laws:LuGre","has":{"m":'))
        n = dice.choice((500, 100_000))
        return written(arrays, nest * n + "1" + "]" * n)
    own = about["expressions"]["has"]
    code, count = f"a{own['code']['array']}", len(own["labels"]["tuple"])
    count += arrays[f"a{own['constants']['array']}"].size
    n = np.arange(dice.choice((9000, 100_000)))
    arrays[code] = np.column_stack([0 * n, count + n - 1, count + n - 1])
    return written(arrays, about)


REACHABLE = ("StringDeserializer", "external", "Importer", "Callback", "FileDeserializer")
EVENTS = ("os.system", "os.exec", "os.posix_spawn", "os.spawn", "os.fork", "subprocess.Popen",
          "ctypes.dlopen", "pickle.find_class", "exec", "os.remove", "os.rename")  # fmt: skip


@contextmanager
def nothing_runs(seen: list[str]) -> Iterator[None]:
    """Collect what a file reaches: CasADi's readers and loaders of code, audited actions of Python.

    CasADi runs shell commands outside of Python's audit, therefore its entrances are watched.
    """
    watched = [(ca, name) for name in REACHABLE]
    watched += [(ca.Function, "deserialize"), (ca.Function, "load")]
    with ExitStack() as patches:
        for owner, name in watched:
            caught = patch.object(owner, name, lambda *_, n=name, **__: seen.append(n))
            patches.enter_context(caught)
        AUDITED.append(seen)
        try:
            yield
        finally:
            AUDITED.remove(seen)


AUDITED: list[list[str]] = []


def audit(event: str, _: object) -> None:
    """To be given to `sys.addaudithook`, once in a process.

    Other threads load code of earlier runs that a compiler has finished meanwhile.
    """
    if AUDITED and event in EVENTS and get_ident() == main_thread().ident:
        AUDITED[-1].append(event)
