"""Compilers in the background: counted calls, an end without traces, no harm from failures."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from backends import needs_compiler

import symfric.integrator.compiled.columns as module
from symfric import rabinowicz, simulate
from symfric.foundation.programs import find_compiler
from symfric.integrator.compiled.columns import Prospect, wait
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
import symfric.integrator.compiled.columns as b
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
