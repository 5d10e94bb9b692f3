"""Compilers beside a run: counted calls, an end without traces, no harm from failures."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from backends import needs_compiler

import symfric.integrator.compiled.background as module
from symfric import Trajectory, rabinowicz, simulate
from symfric.foundation.programs import find_compiler
from symfric.integrator.compiled.background import Prospect, make, wait
from symfric.integrator.compiled.compiler import compiled_before
from symfric.laws import BrownMcPhee
from symfric.model import Model

SOURCE = "double twice(double x) { return 2 * x; }\n"
pytestmark = [needs_compiler, pytest.mark.skipif(os.name != "posix", reason="needs a shell")]

Slow = Callable[[float], None]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache, and as many processors as it takes."""
    wait()
    monkeypatch.setenv("SYMFRIC_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(module, "processors", lambda: 2)
    return tmp_path / "cache"


@pytest.fixture
def calls(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A compiler that waits for a file `go` beside it; the file it keeps its calls in."""
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


def started(calls: Path, number: int) -> None:
    """Wait until so many compilers run."""
    for _ in range(1000):
        if count(calls) >= number:
            return
        time.sleep(0.01)
    raise AssertionError(calls.read_text())


def go(calls: Path) -> None:
    (calls.parent / "go").touch()
    wait()


def stick_slip(model: Model) -> Trajectory:
    return simulate(model, 20.0, rtol=1e-6, t_eval=np.linspace(0, 20, 41))


def test_runs_go_on_in_the_virtual_machine_and_later_ones_use_it(calls: Path) -> None:
    model = rabinowicz(BrownMcPhee())
    plain = simulate(model, 20.0, rtol=1e-6, t_eval=np.linspace(0, 20, 41), backend="vm")
    (integrator,) = model.memory["integrators"].values()
    integrator.vm_time = 1.0
    before = stick_slip(model)
    started(calls, 1)
    assert before.statistics.backend == stick_slip(model).statistics.backend == "vm"
    go(calls)
    after = stick_slip(model)
    assert after.statistics.backend == "compiled"
    assert count(calls) == 1
    for run in (before, after):
        assert all((run[name] == plain[name]).all() for name in plain.signals)


def test_a_run_under_way_goes_over(calls: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    model = rabinowicz(BrownMcPhee())
    plain = simulate(model, 20.0, t_eval=np.linspace(0, 20, 41), backend="vm", max_step=0.002)
    (integrator,) = model.memory["integrators"].values()
    integrator.vm_time = 1.0
    over = simulate(
        model, 20.0, t_eval=np.linspace(0, 20, 41), max_step=0.002, progress=lambda _: go(calls)
    )
    assert over.statistics.backend == "compiled"
    assert (over["x"] == plain["x"]).all()
    assert over.statistics.steps == plain.statistics.steps


def test_signals_are_compiled_beside_and_equal(calls: Path) -> None:
    model = rabinowicz(BrownMcPhee())
    run = stick_slip(model)
    plain = run["friction"]
    (integrator,) = model.memory["integrators"].values()
    columns = integrator.signal_columns
    assert count(calls) == 0
    columns.spent = 1.0
    assert (run.at(run.t)["friction"] == plain).all()
    started(calls, 1)
    assert (run.at(run.t)["friction"] == plain).all()
    go(calls)
    assert (run.at(run.t)["friction"] == plain).all()
    spent = columns.spent
    run.at(run.t)
    assert columns.spent == spent  # none of it in the virtual machine
    assert count(calls) == 1


def prospect(source: str = SOURCE) -> Prospect:
    return Prospect(lambda: source, ("twice",), 100)


def test_one_compiler_at_a_time(calls: Path, folder: Path) -> None:
    sources = [SOURCE + f"/* {k} */\n" for k in range(3)]
    makings = [make(source, "twice") for source in sources]
    started(calls, 1)
    assert count(calls) == 1
    assert not any(making.done for making in makings)
    go(calls)
    assert count(calls) == 3
    assert all(making.done and not making.failed for making in makings)
    assert all(compiled_before(source) is not None for source in sources)
    assert not [path for path in folder.iterdir() if path.name.startswith(".")]


def test_it_begins_where_it_pays_and_looks_into_the_cache_first(calls: Path) -> None:
    some = prospect()
    assert not some.pays(1e-3)
    assert not some.pays(0.05)
    assert count(calls) == 0
    assert not some.pays(0.1)
    started(calls, 1)
    assert not some.pays(10.0)
    go(calls)
    assert some.pays(0.1)
    assert prospect().pays(0.01)
    assert count(calls) == 1


def test_one_processor_is_not_shared(calls: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "processors", lambda: 1)
    some = prospect()
    assert not some.pays(0.2)
    assert some.pays(0.3)  # the caller compiles
    assert count(calls) == 0


def test_failures_are_quiet(monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    some = prospect("no C at all")
    assert not some.pays(1.0)
    wait()
    assert not some.pays(1.0)
    assert some.hopeless
    monkeypatch.setenv("CC", "/bin/true")
    empty = prospect()
    assert not empty.pays(1.0)
    wait()
    assert not empty.pays(1.0)
    assert empty.hopeless
    assert not list(folder.iterdir())


def test_a_compiler_that_hangs_is_given_up(calls: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("symfric.foundation.programs.PATIENCE", 0.0)
    monkeypatch.setattr("symfric.foundation.programs.PER_BYTE", 0.0)
    making = make(SOURCE, "twice")
    started(calls, 1)
    wait()
    assert making.failed


ENDING = """
import os, sys
import symfric.integrator.compiled.background as b
b.processors = lambda: 2
b.make("double twice(double x) {{ return 2 * x; }}", "twice")
while not os.path.getsize({calls!r}): pass
{end}
"""


@pytest.mark.parametrize("end", ["pass", "raise KeyboardInterrupt", "sys.exit(3)"])
def test_an_exit_stops_the_compiler_and_leaves_no_file(calls: Path, folder: Path, end: str) -> None:
    code = ENDING.format(calls=str(calls), end=end)
    subprocess.run([sys.executable, "-c", code], capture_output=True, check=False, timeout=30)
    assert not list(folder.iterdir())
    with pytest.raises(ProcessLookupError):
        os.kill(int(calls.read_text()), signal.SIGCONT)


def test_a_forked_process_leaves_it_alone(calls: Path, folder: Path) -> None:
    """The child starts none, and its end takes nothing away from its parent."""
    end = (
        "pid = os.fork()\n"
        "if not pid:\n"
        "    assert not b.beside()\n"
        "    b.wait()\n"
        "    sys.exit()\n"
        "assert os.waitpid(pid, 0)[1] == 0\n"
        f"open({str(calls.parent / 'go')!r}, 'w').close()\n"
        "b.wait()\n"
    )
    code = ENDING.format(calls=str(calls), end=end)
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, check=False, timeout=30
    )
    assert done.returncode == 0, done.stderr
    assert [path.suffix for path in folder.iterdir()] == [".so"]
    assert count(calls) == 1
