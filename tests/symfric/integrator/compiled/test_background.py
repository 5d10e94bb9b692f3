"""Compilers in the background: counted calls, an end without traces, no harm from failures.

Functions applied to columns: the same numbers in every batch, engine and order.
"""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from backends import needs_compiler

import symfric.integrator.compiled.background as module
from symfric import rabinowicz, simulate
from symfric.foundation.programs import find_compiler
from symfric.integrator.compiled import background, columns
from symfric.integrator.compiled.background import Prospect, wait
from symfric.integrator.compiled.columns import CHAINED, SIDE_BY_SIDE, Columns
from symfric.integrator.compiled.compiler import compiled_before
from symfric.laws import BrownMcPhee

SOURCE = "double twice(double x) { return 2 * x; }\n"
pytestmark = [needs_compiler, pytest.mark.skipif(os.name != "posix", reason="needs a shell")]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache, and two processors."""
    wait()
    monkeypatch.setenv("SYMFRIC_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(module, "processors", lambda: 2)
    return tmp_path / "cache"


@pytest.fixture
def calls(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A compiler that waits for a file `go` next to it; the file that lists its calls."""
    found = find_compiler()
    assert found is not None
    script = tmp_path / "slow"
    script.write_text(
        f"#!/bin/sh\necho $$ >> {tmp_path}/calls\n"
        f'while [ ! -e {tmp_path}/go ]; do sleep 0.01; done\nexec {" ".join(found.command)} "$@"\n'
    )
    script.chmod(0o755)
    monkeypatch.setenv("CC", str(script))
    (tmp_path / "calls").touch()
    return tmp_path / "calls"


def count(calls: Path) -> int:
    return len(calls.read_text().splitlines())


def started(calls: Path) -> None:
    """Wait until a compiler runs."""
    end = time.monotonic() + 60
    while not count(calls):
        assert time.monotonic() < end
        time.sleep(0.01)


def go(calls: Path) -> None:
    (calls.parent / "go").touch()
    wait()


def test_runs_and_signals_use_compiled_code_once_it_is_available(calls: Path) -> None:
    model, times = rabinowicz(BrownMcPhee()), np.linspace(0, 20, 41)
    plain = simulate(model, 20.0, t_eval=times, backend="vm")
    (integrator,) = model.memory["integrators"].values()
    columns = integrator.signal_columns
    integrator.vm_time = 1.0
    before = [simulate(model, 20.0, t_eval=times) for _ in range(2)]
    started(calls)
    assert [run.statistics.backend for run in before] == ["vm", "vm"]
    assert (before[0]["friction"] == plain["friction"]).all()
    go(calls)
    after = simulate(model, 20.0, t_eval=times)
    assert after.statistics.backend == "compiled"
    assert count(calls) == 1
    for run in (before[0], after):
        assert all((run[name] == plain[name]).all() for name in plain.signals)
    columns.spent = 1.0
    assert (after.at(after.t)["friction"] == plain["friction"]).all()
    wait()
    spent = columns.spent
    assert (after.at(after.t)["friction"] == plain["friction"]).all()
    assert columns.spent == spent  # none of it in the virtual machine
    assert count(calls) == 2


def test_a_run_in_progress_switches(calls: Path) -> None:
    model, times = rabinowicz(BrownMcPhee()), np.linspace(0, 20, 41)
    plain = simulate(model, 20.0, t_eval=times, backend="vm", max_step=0.004)
    (integrator,) = model.memory["integrators"].values()
    integrator.vm_time = 1.0
    over = simulate(model, 20.0, t_eval=times, max_step=0.004, progress=lambda _: go(calls))
    assert over.statistics.backend == "compiled"
    assert (over["x"] == plain["x"]).all()
    assert over.statistics.steps == plain.statistics.steps


def prospect(source: str = SOURCE) -> Prospect:
    return Prospect(lambda: source, ("twice",), 100)


def test_one_compiler_at_a_time(calls: Path, folder: Path) -> None:
    sources = [SOURCE + f"/* {k} */\n" for k in range(3)]
    every = [prospect(source) for source in sources]
    assert not any(one.pays(1.0) for one in every)
    started(calls)
    assert count(calls) == 1
    assert not any(one.pays(1.0) for one in every)
    go(calls)
    assert count(calls) == 3
    assert all(one.pays(1.0) for one in every)
    assert all(compiled_before(source) is not None for source in sources)
    assert not [path for path in folder.iterdir() if path.name.startswith(".")]


def test_it_starts_where_it_pays_and_searches_the_cache_first(
    calls: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    some = prospect()
    assert not some.pays(1e-3)
    assert not some.pays(0.05)
    assert count(calls) == 0
    assert not some.pays(0.1)
    started(calls)
    assert not some.pays(10.0)
    go(calls)
    assert some.pays(0.1)
    assert prospect().pays(0.01)
    assert count(calls) == 1
    monkeypatch.setattr(module, "processors", lambda: 1)  # which is not shared
    some = prospect(SOURCE + "\n")
    assert not some.pays(0.2)
    assert some.pays(0.3)  # the caller compiles
    assert count(calls) == 1


def test_failures_are_silent(monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    for compiler, source in ((None, "no C at all"), ("/bin/true", SOURCE), ("/no/such", SOURCE)):
        if compiler is not None:
            monkeypatch.setenv("CC", compiler)
        some = prospect(source)
        assert not some.pays(1.0)
        wait()
        assert not some.pays(1.0)
        assert some.hopeless is (compiler != "/no/such")
        assert not list(folder.iterdir())


ENDING = """
import os, sys
import symfric.integrator.compiled.background as b
b.processors = lambda: 2
b.Prospect(lambda: "double twice(double x) {{ return 2 * x; }}", ("twice",), 100).pays(1.0)
while not os.path.getsize({calls!r}): pass
{end}
"""


@pytest.mark.parametrize("end", ["raise KeyboardInterrupt", "sys.exit(3)"])
def test_an_exit_stops_the_compiler_and_leaves_no_file(calls: Path, folder: Path, end: str) -> None:
    code = ENDING.format(calls=str(calls), end=end)
    subprocess.run([sys.executable, "-c", code], capture_output=True, check=False, timeout=60)
    assert not list(folder.iterdir())
    with pytest.raises(ProcessLookupError):
        os.kill(int(calls.read_text()), signal.SIGCONT)


def test_a_forked_process_leaves_the_compiler_of_its_parent_alone(
    calls: Path, folder: Path
) -> None:
    end = (
        "pid = os.fork()\n"
        "if not pid:\n"
        "    assert not b.possible()\n"
        "    b.wait()\n"
        "    sys.exit()\n"
        "assert os.waitpid(pid, 0)[1] == 0\n"
        f"open({str(calls.parent / 'go')!r}, 'w').close()\n"
        "b.wait()\n"
    )
    code = ENDING.format(calls=str(calls), end=end)
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, check=False, timeout=60
    )
    assert done.returncode == 0, done.stderr
    assert [path.suffix for path in folder.iterdir()] == [".so"]
    assert count(calls) == 1


x, u = ca.SX.sym("x", 2), ca.SX.sym("u")
HALVES = ca.Function("halves", [x, u], [x / 2 + u, x[0] - x[1]])
BOTH = ca.Function("both", [x, u], [x * u])

each_engine = pytest.mark.parametrize("backend", ["vm", "compiled", "auto"])


@each_engine
def test_a_chain_passes_its_first_result_on(backend: str) -> None:
    """x_k+1 = x_k/2 + u_k adds up to a sum of halves."""
    for count in (1, CHAINED - 1, CHAINED, CHAINED + 1, 3 * CHAINED + 5):
        steps = np.arange(count, dtype=float)
        chain = Columns(HALVES, chained=True)
        after, difference = chain([steps], np.array([1.0, 3.0]), backend)
        halves = 0.5 ** np.arange(1, count + 1)
        for k in range(count):
            pushed = (steps[: k + 1] * 0.5 ** np.arange(k, -1, -1)).sum()
            assert after[k] == pytest.approx(np.array([1.0, 3.0]) * halves[k] + pushed, rel=1e-13)
        assert difference.ravel() == pytest.approx(-2 * 2 * halves, rel=1e-9)


@each_engine
def test_columns_in_parallel(backend: str) -> None:
    for count in (0, 1, SIDE_BY_SIDE, SIDE_BY_SIDE + 1):
        pairs, factors = np.arange(2.0 * count).reshape(count, 2), np.arange(float(count))
        (found,) = Columns(BOTH)([pairs, factors], backend=backend)
        np.testing.assert_array_equal(found, pairs * factors[:, None])
    # rows of another size: the loop in C would read beyond their end
    with pytest.raises(ValueError, match=r"rows of 2 numbers|cannot reshape"):
        Columns(BOTH)([np.ones((3, 1)), np.ones(3)], backend=backend)


@each_engine
def test_rows_may_be_reversed_strided_or_picked_from_a_table(backend: str) -> None:
    table, both = np.arange(24.0).reshape(4, 6), Columns(BOTH)
    (found,) = both([table[::-1, 2:4], np.broadcast_to(3.0, (4, 1))], backend=backend)
    np.testing.assert_array_equal(found, 3 * table[::-1, 2:4])
    (found,) = both([table[:, ::3], np.asfortranarray(table)[:, 1]], backend=backend)
    np.testing.assert_array_equal(found, table[:, ::3] * table[:, 1:2])
    which = np.array([3, 0, 0])
    (found,) = both([(table[:, :2], which), np.array([1.0, 2.0, 3.0])], backend=backend)
    np.testing.assert_array_equal(found, table[which, :2] * [[1], [2], [3]])


@each_engine
def test_matrices_zeros_and_empty_arguments(backend: str) -> None:
    A, none = ca.SX.sym("A", 2, 3), ca.SX.sym("none", 0)
    same = Columns(ca.Function("same", [A], [A]))
    (found,) = same([np.arange(12.0).reshape(2, 6)], backend=backend)
    np.testing.assert_array_equal(found, np.arange(12.0).reshape(2, 6))
    sparse = Columns(ca.Function("sparse", [u], [ca.vertcat(u, ca.SX(1, 1), 2 * u)]))
    (found,) = sparse([np.array([1.0, 2.0])], backend=backend)
    np.testing.assert_array_equal(found, [[1, 0, 2], [2, 0, 4]])
    empty = Columns(ca.Function("f", [u, none], [2 * u, none]))
    found, nothing = empty([np.array([1.0, 2.0]), np.zeros((2, 0))], backend=backend)
    np.testing.assert_array_equal(found, [[2], [4]])
    assert nothing.shape == (2, 0)


def test_auto_compiles_when_that_is_expected_to_save_time(monkeypatch: pytest.MonkeyPatch) -> None:
    loaded: list[str] = []

    def load(source: str, name: str) -> object:
        loaded.append(source)
        return columns.__dict__["plain_load"](source, name)

    monkeypatch.setitem(columns.__dict__, "plain_load", columns.load)
    monkeypatch.setattr(columns, "load", load)
    monkeypatch.setattr(background, "processors", lambda: 1)
    double = Columns(ca.Function("twice", [u], [2 * u]))
    double([np.zeros(1)], backend="auto")
    double.spent = 1.0
    double([np.zeros(1)], backend="vm")
    assert loaded == []
    for _ in range(2):
        double([np.zeros(1)], backend="auto")
    assert ["twice" in source for source in loaded] == [True]
    assert double.spent < 1.1
    monkeypatch.setattr(background, "find_compiler", lambda: None)
    double = Columns(ca.Function("twice", [u], [2 * u]), spent=100.0)
    (found,) = double([np.array([3.0])], backend="auto")
    np.testing.assert_array_equal(found, [[6.0]])
    assert len(loaded) == 1
