"""The command line as a whole: help, exit statuses, completions, tables."""

import json
import os
import shlex
import signal
import subprocess
import sys
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from errno import ENOSPC
from math import inf, nan
from pathlib import Path
from typing import Any

import pytest

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
