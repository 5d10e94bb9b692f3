"""The command line as a whole: exit statuses, one sentence an error, nothing else on stdout."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import symfric
from symfric.cli import main

BAD = {
    "no scene": ("run", "run: expected SCENE, got none; see symfric run -h"),
    "no law": ("run rabinowicz", "run: expected --law NAME[,NAME], got none"),
    "unknown command": ("runn", "did you mean run?"),
    "unknown option": ("run rabinowicz --law lugre --lawx 1", "got --lawx; did you mean --law"),
    "option without value": ("run rabinowicz --law", "--law: expected a value, got none"),
    "value without option": ("run drive --law lugre --set m=1 k=2", "got k=2; repeat the option"),
    "value of a flag": ("gallery --quick=1", "--quick: expected no value, got one"),
    "two scenes": ("run drive nip --law lugre", "expected no other argument, got nip"),
    "word as number": ("run drive --law lugre --rtol x", "run: --rtol: expected a number, got 'x'"),
    "half a sample": ("run drive --law lugre --samples 1.5", "expected a whole number, got '1.5'"),
    "no such option": ("--foo", "--foo"),
    "unknown scene": ("run rabinowitz --law lugre", "did you mean rabinowicz"),
    "unknown law": ("run rabinowicz --law lugr", "did you mean lugre"),
    "empty term": ("run rabinowicz --law coulomb+", "empty term"),
    "unknown parameter": ("run rabinowicz --law lugre --set mu=1", "did you mean mu_s"),
    "no number": ("run rabinowicz --law lugre --set mu_s=abc", "mu_s: expected a finite number"),
    "no equals": ("run rabinowicz --law lugre --set mu_s", "NAME=VALUE"),
    "twice": ("run rabinowicz --law lugre --set m=1 --set m=2", "m twice"),
    "out of bounds": ("run rabinowicz --law lugre --set mu_s=-1", "0 <= mu_s"),
    "no duration": ("run rabinowicz --law lugre --t-end soon", "--t-end"),
    "NaN duration": ("run rabinowicz --law lugre --t-end nan", "t_end"),
    "negative duration": ("run rabinowicz --law lugre --t-end -1", "t_end > t_start"),
    "tolerance": ("run rabinowicz --law lugre --rtol 1", "rtol"),
    "backend": ("run rabinowicz --law lugre --backend vn", "did you mean vm"),
    "peer": ("run rabinowicz --law lugre --peer sundails", "did you mean sundials"),
    "peer's method": ("run rabinowicz --law lugre --peer ggl --method radau5", "no --method"),
    "method": ("run rabinowicz --law lugre --method rodas5", "did you mean rodas5p"),
    "unknown state": ("run rabinowicz --law lugre --x0 q=1", "x0"),
    "infinite state": ("run rabinowicz --law lugre --x0 x=inf", "--x0 x: expected a finite"),
    "unknown input": ("run drive --law lugre --input frc=1", "did you mean force"),
    "NaN input": ("run drive --law lugre --input force=nan", "finite number"),
    "missing input": ("run drive --law lugre --input force=none.csv:f", "none.csv"),
    "law twice": ("run drive --law lugre --law lugre", "every law once"),
    "law twice in one": ("report drive --law lugre,dahl,lugre", "every law once"),
    "candidate twice": ("select drive --law lugre,lugre", "every law once"),
    "two laws, one file": ("run drive --law lugre --law dahl --json -", "expected one --law"),
    "folder as file": ("run drive --law lugre --out .", "got a folder"),
    "unwritable": ("run drive --law lugre --out /dev/null/x.csv", "got the file"),
    "picture format": ("run drive --law lugre --plot x.foo", "ending in .png"),
    "laws: unknown": ("laws lugr", "did you mean lugre"),
    "laws: scene parameter": ("laws lugre --set k=1", "--set of law lugre"),
    "laws: set without name": ("laws --set mu_d=1", "name of a law"),
    "laws: normal force": ("laws lugre --plot x.png --normal-force nan", "--normal-force"),
    "identify: no data": ("identify --law stribeck", "DATA"),
    "identify: missing file": ("identify none.csv --law stribeck", "none.csv"),
    "codegen: no folder": ("codegen --law lugre", "--out"),
    "codegen: unknown type": ("codegen --law lugre --out c --real half", "double, float, both"),
    "codegen: file as folder": ("codegen --law lugre --out /dev/null", "got the file"),
    "codegen: compiler": ("codegen --law lugre --out c --compiler none", "'none'"),
    "demo: no data": ("demo --data none", "none"),
}


@pytest.fixture(autouse=True)
def inside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_one_sentence_and_status_2(
    case: str, capsys: pytest.CaptureFixture[str]
) -> None:
    line, hint = BAD[case]
    assert main(line.split()) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("symfric: ")
    assert err.count("\n") == 1
    assert hint in err


def test_bad_input_leaves_no_files_behind(tmp_path: Path) -> None:
    files = ["--out", "x.csv", "--plot", "x.png", "--json", "x.json"]
    assert main(["run", "drive", "--law", "lugr", *files]) == 2
    assert list(tmp_path.iterdir()) == []


def test_an_operating_system_error_names_the_file(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "drive", "--law", "lugre", "--input", "force=none.csv:f"]) == 2
    assert "'none.csv': expected a file, got nothing there" in capsys.readouterr().err


def test_debug_shows_where_an_error_comes_from(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SYMFRIC_DEBUG", "1")
    with pytest.raises(ValueError, match="did you mean lugre"):
        main(["laws", "lugr"])


@pytest.mark.parametrize(("module", "line"), [("typer", "--help"), ("casadi", "laws")])
def test_an_interrupt_while_something_is_imported_is_one_sentence(module: str, line: str) -> None:
    """Ctrl-C in the first second printed a traceback."""
    stopped = (
        "import sys\n"
        "class Interrupt:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        f"        if name == '{module}': raise KeyboardInterrupt\n"
        "sys.meta_path.insert(0, Interrupt())\n"
        "from symfric.__main__ import main\n"
        "sys.exit(main())\n"
    )
    root = Path(symfric.__file__).parents[1]
    done = subprocess.run(
        [sys.executable, "-c", stopped, line],
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | {"PYTHONPATH": str(root)},
    )
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "symfric: interrupted\n")


def test_no_summary_of_a_command_is_cut(capsys: pytest.CaptureFixture[str]) -> None:
    """At 80 columns `codegen`, `bench` and others ended in dots."""
    assert main(["--help"]) == 0
    shown = capsys.readouterr().out
    assert "codegen" in shown
    assert "..." not in shown.partition("Commands:")[2]


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"symfric {symfric.__version__}\n"


def test_without_a_command_the_help_lists_them(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 0
    out = capsys.readouterr().out
    assert all(name in out for name in ("laws", "run", "identify", "codegen", "demo"))


START = "import sys; from symfric.cli import main; sys.exit(main())"


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    """The installed command, as users run it."""
    return subprocess.run(
        [sys.executable, "-c", START, *arguments],
        capture_output=True,
        text=True,
        stdin=subprocess.DEVNULL,
        check=False,
    )


def test_as_a_process_bad_input_ends_with_status_2_and_no_traceback() -> None:
    done = run("run", "rabinowicz", "--law", "lugr")
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1


def test_as_a_process_a_warning_is_one_line_and_json_stays_pure() -> None:
    done = run("run", "drive", "--law", "viscous", "--t-end", "1", "--rtol", "1e-3", "--json", "-")
    assert done.returncode == 0
    assert done.stdout.startswith("{\n")
    assert done.stdout.endswith("}\n")
    assert done.stderr.startswith("symfric: warning: simulate: rtol = 0.001")
    assert done.stderr.count("\n") == 1


def test_a_defect_is_one_line_too() -> None:
    code = "import sys, symfric.cli.app as app; app._prepare_process(); raise RuntimeError('a\\nb')"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr.startswith("symfric: internal error, RuntimeError: a b;")
    assert done.stderr.count("\n") == 1


@pytest.mark.skipif(os.name == "nt", reason="POSIX signals")
def test_an_interrupt_ends_with_status_130_and_keeps_what_there_is(tmp_path: Path) -> None:
    loaded = (
        "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); "  # if ignored
        "import symfric.cli.run, symfric.integrator.simulate; print('ready', flush=True)"
    )
    code = START.replace("sys.exit", f"{loaded}; sys.exit")
    line = "run rabinowicz --law lugre --t-end 1e7 --backend vm --out part.csv --json part.json"
    process = subprocess.Popen(
        [sys.executable, "-c", code, *line.split()],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Interrupted by the user" in err
    assert "Traceback" not in err
    assert '"status": "INTERRUPTED"' in (tmp_path / "part.json").read_text()
    assert (tmp_path / "part.csv").stat().st_size > 0
