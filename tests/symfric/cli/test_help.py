"""What `symfric COMMAND -h` shows: one form for one thing, 80 columns, examples to copy."""

import shlex
from collections import defaultdict
from typing import Any

import pytest

from symfric.cli import main
from symfric.cli.app import COMMANDS, Commands, arguments, is_option, prose_and_examples

EVERY: dict[str, Any] = {
    name: Commands(name="symfric").get_command(None, name) for name in COMMANDS
}

OF_ITS_OWN = {"--out", "--free", "--data"}
"""A folder, a page or a unit; what stays open in C or is fitted; a folder or a record."""


@pytest.mark.parametrize("name", COMMANDS)
def test_the_help_fits_80_columns_and_names_what_stands_for_what(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([name, "-h"]) == 0
    shown = capsys.readouterr().out
    assert main([name, "--help"]) == 0
    assert capsys.readouterr().out == shown
    assert max(map(len, shown.splitlines())) <= 80
    assert "<" not in shown  # a type of Python in the place of a word
    assert shown.startswith(f"Usage: symfric {name} [OPTIONS]")


def test_an_option_has_one_form_in_all_commands() -> None:
    forms = defaultdict[str, set[str]](set)
    for command in EVERY.values():
        for option in filter(is_option, command.params):
            assert option.is_flag or option.metavar, (command.name, option.opts)
            assert option.help.endswith("."), (command.name, option.opts)
            forms[option.opts[0]].add(option.metavar or "")
    assert forms.pop("--law") == {"NAME", "NAME[,NAME]"}  # one, or several
    several = {name: found for name, found in forms.items() if len(found) > 1}
    assert several.keys() <= OF_ITS_OWN, several


@pytest.mark.parametrize("name", COMMANDS)
def test_examples_are_lines_that_the_command_takes(name: str) -> None:
    examples = prose_and_examples(EVERY[name].help)[1]
    assert examples
    for line in examples:
        words = shlex.split(line)
        assert words[:2] == ["symfric", name]
        EVERY[name].make_context(name, words[2:])


def test_an_example_breaks_before_an_option_and_joins_again(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["select", "-h"]) == 0
    shown = capsys.readouterr().out.partition("Examples:\n")[2]
    assert "\\\n      --" in shown
    lines = [" ".join(line.split()) for line in shown.replace("\\\n", " ").splitlines()]
    assert lines == prose_and_examples(EVERY["select"].help)[1]


def test_arguments_stand_in_the_usage_as_in_the_list(capsys: pytest.CaptureFixture[str]) -> None:
    for name, line in {"gallery": "[NAME...]", "identify": "DATA...", "run": "SCENE"}.items():
        assert len(arguments(EVERY[name])) == 1
        assert main([name, "-h"]) == 0
        shown = capsys.readouterr().out
        assert f"Usage: symfric {name} [OPTIONS] {line}\n" in shown
        assert f"\nArguments:\n  {line}  " in shown
