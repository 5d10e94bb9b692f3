"""Packs: frozen data with expressions as plain arrays."""

import json
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from io import BytesIO
from math import inf, nan
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest

from symfric.foundation import packed
from symfric.foundation.files import write_text
from symfric.foundation.parameters import Variable
from symfric.foundation.status import Status
from symfric.laws import GMS, LuGre, Table


@dataclass(frozen=True, eq=False)
class Pair:
    """Two things."""

    a: Any
    b: Any


def again(thing: object) -> Any:
    return packed.loads(packed.dumps(thing))


def test_numbers_texts_and_containers_come_back_with_their_types() -> None:
    values = (1, 2.5, 5e-324, -0.0, True, None, "µ", [1, (2,)], {"a": (), 3: "b"}, Status.JAMMED)
    back = again(values)
    assert back == values
    assert list(map(type, back)) == list(map(type, values))
    strange = again((inf, -inf, nan))
    assert strange[:2] == (inf, -inf)
    assert np.isnan(strange[2])
    array = np.array([[1.0, nan], [5e-324, -0.0]])
    assert again(array).tobytes() == array.tobytes()
    assert again(np.float64(0.1)) == 0.1


def test_symbols_stay_the_same_symbols_within_a_pack() -> None:
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    back = again(Pair((x, ca.sin(x) * y), ca.vertcat(y, x)))
    f = ca.Function("f", [back.b], [back.a[1]])  # fails where symbols are others
    assert float(f([2.0, 0.5])) == np.sin(0.5) * 2.0
    assert again(ca.DM([[1, 0], [0, 2]])).sparsity().nnz() == 4


@dataclass(frozen=True, eq=False)
class Shell:
    """Is packed as a pair that is not referenced elsewhere."""

    value: int

    def packed_as(self) -> Pair:
        return Kernel(self.value, 0)


class Kernel(Pair):
    def unpacked(self) -> Shell:
        return Shell(self.a)


def test_an_object_referenced_twice_is_one_object_and_others_stay_separate() -> None:
    shared = Pair(1, 2)
    back = again(Pair(shared, [shared]))
    assert back.a is back.b[0]
    # objects made for a pack: where one is gone the next one may lie in its place
    shells = again([Shell(k) for k in range(50)])
    assert [shell.value for shell in shells] == [*range(50)]


def test_laws_and_variables() -> None:
    law = again(GMS())
    assert repr(law) == repr(GMS())
    table = Table((0.0, 1.0), (0.2, 0.1))
    assert repr(again(table)) == repr(table)
    v = again(Variable("v", "m/s", lower=-1.0))
    assert (v.name, v.lower, v.upper, v.symbol.name()) == ("v", -1.0, inf, "v")


def test_what_no_pack_holds_is_refused_with_its_place() -> None:
    @dataclass(frozen=True)
    class Local:
        value: int = 0

    function = r"pack\.a\[1\]: expected a function that can be imported.*the function <lambda>"
    for thing, message in (
        (Pair((1, lambda: 0), 2), function),
        (Pair(1, LuGre), r"pack\.b: expected numbers.*the class LuGre"),
        (Pair(Local(), 2), r"pack\.a: expected an object whose class can be imported"),
        (np.array([object()]), "expected an array of numbers"),
    ):
        with pytest.raises(ValueError, match=message):
            packed.dumps(thing)


def double(x: float) -> float:
    return 2 * x


def test_functions_that_can_be_imported_are_kept_by_their_names() -> None:
    back = again(Pair(double, partial(double, x=3.0)))
    assert back.a is double
    assert back.b() == 6.0


def load(thing: object, **how: Any) -> Any:
    buffer = BytesIO()
    packed.dump(buffer, thing, "kind", 1)
    buffer.seek(0)
    return packed.load(buffer, "kind", 1, **how)


def test_files_hold_classes_and_functions_handed_over_and_classes_of_symfric() -> None:
    assert repr(load(LuGre())) == repr(LuGre())
    for thing, own, name in ((Pair(1, 2), [], "Pair"), (Pair(double, 2), [Pair], "double")):
        with pytest.raises(ValueError, match=rf"got {name} of .*own=\[{name}\]"):
            load(thing, own=own)
    assert load(Pair(1, 2), own=[Pair]).b == 2
    assert load(Pair(double, 2), own=[Pair, double]).a is double
    for known in (write_text, packed.dumps):  # not even those of symfric: who reads might call them
        with pytest.raises(ValueError, match="expected functions of symfric"):
            load((known,))


def naming(path: str, **arrays: Any) -> BytesIO:
    """A file of an object of this class, without fields."""
    return holding({"is": path, "has": {}}, **arrays)


def holding(content: Any, **arrays: Any) -> BytesIO:
    """A file with this content as JSON, whose only expression is the symbol v."""
    buffer = BytesIO()
    packed.dump(buffer, ca.SX.sym("v"), "kind", 1)
    buffer.seek(0)
    whole = dict(np.load(buffer))
    about = json.loads(whole.pop("about").tobytes()) | {"content": content}
    head = np.frombuffer(json.dumps(about).encode(), np.uint8)
    buffer = BytesIO()
    np.savez(buffer, about=head, **whole, **arrays)  # pyright: ignore[reportArgumentType]
    buffer.seek(0)
    return buffer


def test_a_file_names_data_of_this_version_only() -> None:
    foreign, gone = "expected a file that symfric wrote", r"this version of symfric has, got \w+ of"
    for path, message in (
        ("symfric.foundation.files:write_text", foreign), ("symfric.laws:LuGre", foreign),
        ("symfric.foundation.checks:Path", foreign), ("symfric.cli.app:typer.Typer", foreign),
        ("symfric.foundation.programs:Compiler", foreign),
        ("identification.residuals.shots:delayed", foreign),
        ("symfriction:Law", "expected classes of symfric, got Law of symfriction"),
        ("symfric.laws.gone:Law", gone), ("symfric.laws.dynamic.lugre:Gone", gone),
    ):  # fmt: skip
        with pytest.raises(ValueError, match=message):
            packed.load(naming(path), "kind", 1)


def test_fields_out_of_a_file_have_their_types_and_pass_the_checks_of_their_class() -> None:
    path, good = "symfric.foundation.variable:Variable", {"name": "v", "unit": "m/s"}
    found = packed.load(holding({"is": path, "has": good | {"symbol": {"SX": 0}}}), "kind", 1)
    assert (found.name, found.nominal) == ("v", 1.0)
    for wrong in ({"nominal": "1"}, {"nominal": True}, {"nominal": -1.0}, {"name": ["v"]},
                  {"lower": 2.0, "upper": 1.0}, {"memory": {}}, {"__class__": 1}):  # fmt: skip
        has = good | {"symbol": {"SX": 0}} | wrong
        with pytest.raises(ValueError, match="expected a file that symfric wrote"):
            packed.load(holding({"is": path, "has": has}), "kind", 1)


def test_a_file_of_the_format_that_could_run_code_is_refused_with_the_reason() -> None:
    with pytest.raises(ValueError, match="an older format, which could run code") as error:
        packed.load(naming("symfric.laws:LuGre", expressions=np.zeros(3)), "kind", 1)
    assert "\n" not in str(error.value)


def test_functions_and_symbols_of_mx_are_in_pickles_only() -> None:
    x = ca.MX.sym("x")
    table = ca.interpolant("table", "linear", [[0.0, 1.0]], [2.0, 4.0])
    f = ca.Function("f", [x], [table(x)])
    back = again(Pair((x, ca.sin(x)), f))
    assert float(back.b(0.5)) == 3.0
    assert float(ca.Function("g", [back.a[0]], [back.a[1]])(0.5)) == np.sin(0.5)
    for thing in (x, f):
        with pytest.raises(ValueError, match=r"pack\.a: expected expressions in SX, and Functions"):
            load(Pair(thing, 0), own=[Pair])
    text = {"serialized": [f.serialize(), None]}
    with pytest.raises(ValueError, match="expected a file that symfric wrote"):
        packed.load(holding(text), "kind", 1)


def test_a_function_in_a_file_is_its_expressions() -> None:
    x, y = ca.MX.sym("x", 2), ca.MX.sym("y")
    back = load(ca.Function("f", [x, y], [y * x, ca.sum1(x)], ["x", "y"], ["a", "b"]))
    assert (back.name(), back.name_in(), back.name_out()) == ("f", ["x", "y"], ["a", "b"])
    assert float(back([1.0, 2.0], 3.0)[1]) == 3.0


def test_a_function_in_a_file_has_no_options_and_no_path(tmp_path: Path) -> None:
    """Options start a shell (`jit`), and a single text is the path of a file of CasADi's."""
    mark, v = tmp_path / "mark", ca.SX.sym("v")
    flags = {"compiler": "gcc", "flags": [f"$(touch {mark})"]}
    options = {"jit": True, "compiler": "shell", "jit_options": flags}
    with suppress(RuntimeError):  # as the compiler is
        ca.Function("f", [v], [v * v], ["a"], ["b"], options)
    assert mark.exists()
    mark.unlink()
    ca.Function("f", [v], [v * v]).save(str(tmp_path / "f.casadi"))
    parts: list[Any] = ["f", [{"SX": 0}], [{"SX": 0}], ["a"], ["b"]]
    assert float(packed.load(holding({"Function": parts}), "kind", 1)(2.0)) == 2.0
    text = packed._Writer(trusted=False).write("", options)  # pyright: ignore[reportPrivateUsage]
    for wrong in ([*parts, text], [*parts[:3], text], [str(tmp_path / "f.casadi")], parts[:3]):
        with pytest.raises(ValueError, match="expected a file that symfric wrote"):
            packed.load(holding({"Function": wrong}), "kind", 1)
    assert not mark.exists()


@dataclass
class Armed:
    """What a pickle would run."""

    def __reduce__(self) -> Any:
        return FIRED.append, (1,)


FIRED: list[int] = []


def test_nothing_in_a_file_is_run() -> None:
    buffer = naming("symfric.laws.dynamic.lugre:LuGre", a9=np.array([Armed()], dtype=object))
    with pytest.raises(ValueError, match="expected a file that symfric wrote"):
        packed.load(buffer, "kind", 1)
    assert FIRED == []
