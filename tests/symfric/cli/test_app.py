"""The command line as a whole: help, exit statuses, completions, tables.

Bad command lines: one sentence on standard error, status 2, no files, no defect.
"""

import json
import os
import shlex
import signal
import subprocess
import sys
import tomllib
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from errno import ENOSPC
from math import inf, nan
from pathlib import Path
from typing import Any

import pytest
from fits import make
from robots import SMALL
from tables import sampled

import symfric as package
from symfric.cli import main, output
from symfric.cli.app import (
    COMMANDS,
    TEXTS,
    Commands,
    arguments,
    is_option,
    prose_and_examples,
    sentence,
)

EVERY: dict[str, Any] = {
    name: Commands(name="symfric").get_command(None, name) for name in COMMANDS
}
OF_ITS_OWN = {"--out", "--free", "--data"}
"""A folder, a page or a unit; what stays open in C or is fitted; a folder or a record."""
START = "from symfric.cli import main; main(); raise RuntimeError('a\\nb')"


@pytest.mark.parametrize("name", COMMANDS)
def test_help_fits_80_columns_with_examples_that_the_command_takes(name: str, symfric) -> None:
    shown = symfric(f"{name} -h").out
    assert symfric(f"{name} --help").out == shown
    assert "<" not in shown  # a type of Python in the place of a word
    words = [f"symfric {name} [OPTIONS]"]
    for argument in arguments(EVERY[name]):
        text = argument.metavar + "..." * (argument.nargs == -1)
        words.append(text if argument.required else f"[{text}]")
        assert f"\nArguments:\n  {words[-1]}  " in shown
    assert shown.startswith(f"Usage: {' '.join(words)}\n")
    examples = prose_and_examples(EVERY[name].help)[1]
    shown = shown.partition("Examples:\n")[2]
    assert name != "select" or "\\\n      --" in shown
    shown = shown.replace("\\\n", " ")
    assert [" ".join(line.split()) for line in shown.splitlines()] == examples != []
    for line in examples:
        assert line.startswith(f"symfric {name}")
        EVERY[name].make_context(name, shlex.split(line)[2:])


def test_an_option_has_one_form_in_all_commands_and_all_texts_are_used() -> None:
    texts, used = TEXTS, set[str]()
    found = defaultdict[str, set[str]](set)
    for name, command in EVERY.items():
        own = {p.name for p in command.params} - {"help"}
        assert own >= texts.get(name.replace("-", "_"), {}).keys()
        used |= own
        for option in filter(is_option, command.params):
            assert option.is_flag or option.metavar, (name, option.opts)
            assert option.help.endswith("."), (name, option.opts)
            found[option.opts[0]].add(option.metavar or "")
    assert used >= texts["all"].keys()
    assert found.pop("--law") == {"NAME", "NAME[,NAME]"}  # one, or several
    assert {name for name, metavars in found.items() if len(metavars) > 1} <= OF_ITS_OWN


def test_without_a_command_the_help_lists_them_uncut(symfric) -> None:
    shown = symfric("").out
    assert symfric("--help").out == shown
    table = shown.partition("Commands:")[2]
    assert all(f"\n  {name} " in table for name in COMMANDS)
    assert "..." not in table
    assert symfric("--version").out == f"symfric {package.__version__}\n"


def test_debug_shows_where_an_error_comes_from(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SYMFRIC_DEBUG", "1")
    with pytest.raises(ValueError, match="did you mean lugre"):
        main(["laws", "lugr"])


def run(code: str, *words: str) -> subprocess.CompletedProcess[str]:
    root = Path(package.__file__).parents[1]
    return subprocess.run(
        [sys.executable, "-c", code, *words],
        capture_output=True,
        text=True,
        stdin=subprocess.DEVNULL,
        check=False,
        env=os.environ | {"PYTHONPATH": str(root)},
    )


def test_an_interrupt_while_something_is_imported_is_one_sentence() -> None:
    stopped = (
        "import sys\n"
        "class Interrupt:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        "        if name == 'typer': raise KeyboardInterrupt\n"
        "sys.meta_path.insert(0, Interrupt())\n"
        "from symfric.__main__ import main\n"
        "sys.exit(main())\n"
    )
    done = run(stopped, "--help")
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "symfric: interrupted\n")


def test_as_a_process_warnings_and_defects_are_one_line_and_json_stays_pure() -> None:
    line = "run drive --law viscous --t-end 1 --rtol 1e-3 --backend vm --json -"
    done = run(START, *line.split())
    assert done.returncode == 1
    assert json.loads(done.stdout)["status"] == "SUCCESS"
    first, second = done.stderr.splitlines()
    assert first.startswith("symfric: warning: simulate: rtol = 0.001")
    assert second.startswith("symfric: internal error, RuntimeError: a b;")


def test_an_interrupt_ends_with_status_130_and_keeps_the_results_so_far(
    symfric, monkeypatch: pytest.MonkeyPatch
) -> None:
    @contextmanager
    def progress(_: str) -> Iterator[Callable[[float], None]]:
        yield lambda fraction: signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(output, "progress", progress)
    line = "run rabinowicz --law lugre --t-end 1e4 --backend vm --out part.csv --json part.json"
    printed = symfric(line, 130)
    assert "Interrupted by the user" in printed.err
    assert "INTERRUPTED: see the last line" in printed.out
    assert '"status": "INTERRUPTED"' in Path("part.json").read_text()
    assert Path("part.csv").stat().st_size > 0


COMPLETED = {
    "symfric ru": ["run"],
    "symfric run rabin": ["rabinowicz"],
    "symfric run drive --law lugre_n": ["lugre_normalised"],
    "symfric run drive --law coulomb+visc": ["coulomb+viscous"],
    "symfric run drive --law lagged(stri": ["lagged(stribeck"],
    "symfric run rabinowicz --law dahl --set v_b": ["v_belt="],
    "symfric laws gms --set fo": ["form="],
    "symfric laws lugre --figure hyst": ["hysteresis"],
    "symfric laws lugre --compare random_": ["random_bristles"],
    "symfric identify a.csv --law dahl,gm": ["dahl,gms"],
    "symfric identify a.csv --law dahl,coulomb+visc": ["dahl,coulomb+viscous"],
    "symfric run rabinowicz --law dahl --preset jing": ["jing_mi_table_3"],
    "symfric run pendulum_box --law dahl --law-of hi": ["hinge="],
    "symfric run pendulum_box --law dahl --law-of hinge=gm": ["hinge=gms"],
    "symfric ocp swing_up_of_nothing": [],
    "symfric ocp out_": ["out_and_back"],
    "symfric bench iv": ["ivp"],
    "symfric select drive --need stiction,strib": ["stiction,stribeck"],
    "symfric gallery self": ["self_tuning/"],
    "symfric gallery self_tuning/fig_07": ["self_tuning/fig_07"],
    "symfric gallery no": [],
}


@pytest.mark.parametrize("words", COMPLETED)
def test_words_are_completed(
    words: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("_SYMFRIC_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", words)
    monkeypatch.setenv("COMP_CWORD", str(len(words.split()) - 1))
    with pytest.raises(SystemExit, match="0"):  # the shell is answered at once
        main([])
    assert capsys.readouterr().out.split() == COMPLETED[words]


def test_tables_align_numbers_and_stay_within_80_columns(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    output.show_table(["name", "value", "note"], [("a", 1.0, "long " * 40), ("b", 123456.0, "")])
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 80
    assert lines[2].index("1") + 1 == lines[-1].index("123456") + 6
    output.show_table(["v [m/s]"], [("[bold]x",)], title="t [s]")  # brackets are no markup
    output.show("friction [N]")
    out = capsys.readouterr().out
    assert all(text in out for text in ("v [m/s]", "[bold]x", "t [s]", "friction [N]"))


def test_without_a_terminal_no_word_is_cut_and_every_row_is_a_line(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("COLUMNS", raising=False)
    words = " ".join(f"word{k}" for k in range(40))
    output.show_table(["name", "time per call [us]", "note"], [("a", nan, words), ("b", 2.0, "")])
    head, rule, *rows = capsys.readouterr().out.splitlines()
    assert "time per call [us]" in head
    assert len(rule) > 200
    assert [row.split()[:2] for row in rows] == [["a", "-"], ["b", "2"]]
    assert words in rows[0]
    assert not rows[1].endswith(" ")


def test_columns_share_a_narrow_terminal() -> None:
    rows = [["task", "time per call [us]"], ["words of several lengths", "1.5"]]
    assert output.column_widths(rows, 80) == [24, 18]
    assert output.column_widths(rows, 25) == [13, 9]
    assert output.column_widths(rows, 5) == [7, 4]


def test_json_docstrings_and_notes(capsys: pytest.CaptureFixture[str]) -> None:
    output.emit_json({"a": [inf, nan, 1.5], "b": {"c": -inf}}, "-")
    assert json.loads(capsys.readouterr().out) == {"a": [None, None, 1.5], "b": {"c": None}}
    output.show_doc("Name.\n\n    F = a\n      + b\n\nOne\nsentence.\nLimits: none.\nSource: me.")
    lines = capsys.readouterr().out.splitlines()
    assert lines[:5] == ["Name.", "", "    F = a", "      + b", ""]
    assert lines[5:8] == ["One sentence.", "Limits: none.", "Source: me."]
    output.say_written("a.csv", None, "-")
    with output.progress("work") as tell:  # silent without a terminal
        tell("name", 0.5)
    assert capsys.readouterr().err == "wrote a.csv\n"


def test_errors_of_the_system_are_sentences() -> None:
    for file, place in (("run.npz",), " for 'run.npz'"), ((), ""):
        reported = sentence(OSError(ENOSPC, "No space left on device", *file))
        assert reported.startswith(f"expected free disk space, got none{place}; free some")
    assert sentence(OSError(13, "Permission denied", "x.csv")) == "'x.csv': Permission denied"
    assert "a task that fits into memory" in sentence(MemoryError())


TEXT = Path(__file__).with_name("refusals.toml").read_text(encoding="utf-8")
NUMBERS = ["abc", "nan", "-inf", "1,5"]
COUNTS = [*NUMBERS, "1.5", "1e12", "-1", "10000000000000000000000", "1e400"]
PAIRS = ["mu_d=", "=1", "nonsense=1", "mu_d=1=2", *(f"mu_d={x}" for x in NUMBERS[:5])]
LAWS = [
    "", " ", "+", "lugre)", "lagged()", "x" * 5000,
    "lagged(" * 500 + "lugre" + ")" * 500, "\x1b[31m", "../lugre", "%s",
]  # fmt: skip
FILES = ["/no-such-folder/x{}", "record.csv/x{}", ".", "loop/x{}", "a" * 300 + "{}"]
PICTURES = [f.format(".png") for f in FILES] + ["x", "x.xyz", ".png", "x.png.exe", ""]
TABLES = [f.format("") for f in FILES]
DATA = ["force=", "force=bytes.csv:force", "force=huge.csv:force", "force=long.csv:force",
        "force=loop.csv:x", "force=empty.csv:force", "force=.:x"]  # fmt: skip
GRID = {
    "run rabinowicz --law brown_mcphee --t-end 0.01": {
        "law": LAWS, "set": PAIRS, "x0": ["v=abc", "v=nan"], "t-end": [*NUMBERS, "0"],
        "rtol": [*NUMBERS, "0"], "samples": [*COUNTS, "0"], "max-step": [*NUMBERS, "-1"],
        "times": [*NUMBERS, "", ",", "2,1", "1,1"], "out": TABLES, "plot": PICTURES, "json": TABLES,
        "input": ["force=1", "force", "="], "animate": ["x", "x.png"], "method": ["", "AUTO"],
    },
    "run drive --law brown_mcphee --t-end 0.01": {"input": DATA},
    "run pendulum --law brown_mcphee": {"animate": ["x.mov", "/no-such-folder/x.gif", "."]},
    "laws lugre": {"figure": ["", "lagg"], "compare": LAWS, "normal-force": [*NUMBERS, "-1"]},
    "laws": {"": LAWS[2:]},
    "identify record.csv --law coulomb+viscous": {
        "law": [*LAWS, ","], "validate": ["none.csv", ".", "words.csv"], "column": ["x", "x="],
        "normal-force": [*NUMBERS, "0"], "fix": [*PAIRS, "m=abc"], "free": ["nonsense", ""],
        "unit": ["", "furlong", "x=furlong", "nonsense=m"], "step": [*NUMBERS, "0"],
        "noise": ["force", "force=0", "y=1"], "starts": COUNTS, "workers": COUNTS,
    },
    "identify --law coulomb": {
        "": [".", "x.txt", "bytes.csv", "huge.csv", "loop.csv", "damaged.mat", "x.xlsx", ""],
    },
    "codegen --law stribeck --out c": {
        "law": LAWS, "set": PAIRS, "step-size": [*NUMBERS, "0"], "name": ["a b", "1a", "for", ""],
        "free": ["nonsense", ""], "compiler": ["", "/dev/null", "'"],
    },
    "demo": {"out": ["/dev/null", "/no-such-folder/x"]},
}  # fmt: skip
"""Good line -> option -> bad values; "" for an argument."""


def lines() -> Iterator[tuple[list[str], str]]:
    """Yield bad lines, and a part of their sentences."""
    for command, refused in tomllib.loads(TEXT).items():
        for line, part in refused.items():
            yield shlex.split(f"{command} {line}"), part
    for good, options in GRID.items():
        for name, values in options.items():
            for value in values:
                yield [*good.split(), *([f"--{name}"] if name else []), value], ""
    for scene in ("", "Rabinowicz", ".urdf", "loop.urdf", "3"):
        yield ["run", scene, "--law", "lugre"], ""


def prepare(folder: Path) -> None:
    """Files that lines name, most of them broken."""
    rows = [f"{0.01 * k},{0.001 * k * k},{1 + k % 7}" for k in range(100)]
    texts = {
        "record.csv": "\n".join(["t [s],x [m],force [N]", *rows]),
        "twice.csv": "t [s],force [N],force [N]\n0,1,2\n1,1,2\n",
        "units.csv": "t [s],force [m]\n0,1\n1,2\n",
        "words.csv": "t [s],force [N]\n0,one\n1,two\n",
        "empty.csv": "",
        "header.csv": "t [s],x [m],force [N]\n",
        "back.csv": "t [s],x [m],force [N]\n1,1,1\n0,2,2\n",
        "huge.csv": f"t [s],force [N]\n0,{'1' * 200_000}\n",
        "long.csv": "t [s],force [N]\n0,1,5\n1,2,5\n",
        "broken.py": "a = 1\nb = a / 0\n",
        "syntax.py": "a = (\n",
        "exits.py": "raise SystemExit(3)\n",
        "laws.py": "from symfric import StaticLaw\nclass Branch(StaticLaw):\n"
        "    def force(self, v, N, z=()): return N if v > 0 else -N\nnumber = 3\n",
        "robot.urdf": SMALL,
        "damaged.urdf": "<robot>",
        "axis.urdf": SMALL.replace("0 1 0", "0 1"),
    }
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    make(records=1, starts=1, n=200).to_json(folder / "fit.json")
    (folder / "bytes.csv").write_bytes(bytes(range(256)))
    (folder / "damaged.mat").write_bytes(b"MATLAB 5.0 MAT-file" + bytes(range(200)))
    for name in ("loop", "loop.csv", "loop.urdf"):
        (folder / name).symlink_to(folder / name)


def verdict(line: list[str], part: str, capsys: pytest.CaptureFixture[str]) -> str:
    """ "" for one sentence that holds `part` and status 2, else what is wrong with it."""
    try:
        status = main(line)
    except Exception as error:  # noqa: BLE001  (whatever comes is the finding)
        return f"{type(error).__name__}: {str(error)[:150]}"
    out, err = capsys.readouterr()
    reasons = [text for text in err.splitlines() if not text.startswith("symfric: warning:")]
    if status != 2:
        return f"status {status}: {err[:150]}"
    if (
        out
        or len(reasons) != 1
        or not reasons[0].startswith("symfric: ")
        or "internal error" in err
    ):
        return f"printed: {out[:80]!r}, {err[:150]!r}"
    if part not in err:
        return f"no {part!r} in {err!r}"
    return "" if len(reasons[0]) < 700 and ".cpp" not in err else f"long: {err[:150]!r}"


@pytest.mark.parametrize("share", sampled(range(3), of=3))
def test_every_bad_line_is_one_sentence_and_status_2(
    share: int, mine: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = mine.parent
    prepare(folder)
    before = sorted(path.name for path in folder.iterdir())
    capsys.readouterr()
    wrong = [
        f"{' '.join(word[:40] or repr(word) for word in line)}: {fault}"
        for line, part in [*lines()][share::3]
        if (fault := verdict(line, part, capsys))
    ]
    assert not wrong, "\n".join(wrong)
    assert sorted(path.name for path in folder.iterdir()) == before
