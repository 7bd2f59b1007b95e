"""The command line as a user meets it: help pages, wrong words, errors in one line."""

from __future__ import annotations

import re
import subprocess
import sys

import pytest

from irlpilco_ros.cli import COMMANDS, build_parser, main

NAMES = [command.__name__.rpartition(".")[2].replace("_", "-") for command in COMMANDS]


def help_page(capsys, *words):
    with pytest.raises(SystemExit) as stop:
        main([*words, "--help"])
    assert stop.value.code == 0
    return capsys.readouterr().out


def test_the_first_page_lists_every_command(capsys):
    page = help_page(capsys)
    assert NAMES == ["demo", "learn", "train", "report", "inspect", "recover", "cart-pole", "study"]
    assert all(re.search(rf"\n    {name}\s", page) for name in NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_every_command_has_a_page_with_examples_that_parse(capsys, name):
    page = help_page(capsys, name)
    _, _, examples = page.partition("examples:\n")
    lines = examples.replace("\\\n", " ").splitlines()
    commands = [line.partition("   ")[0] if line[:1] != " " else line.strip() for line in lines]
    own = [line.split("    ")[0].split()[1:] for line in commands if line.startswith("irlpilco ")]
    assert own
    for words in own:
        assert build_parser().parse_args(words).run


def test_no_command_is_wrong_usage(capsys):
    with pytest.raises(SystemExit) as stop:
        main([])
    assert stop.value.code == 2
    assert "COMMAND" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["inspect", "recover"])
def test_an_error_is_one_line_on_stderr(capsys, tmp_path, name):
    assert main([name, str(tmp_path / "missing")]) == 1
    output = capsys.readouterr()
    assert output.out == ""
    assert output.err.startswith("irlpilco: ")
    assert "missing" in output.err
    assert output.err.count("\n") == 1


def test_a_reader_that_goes_away_is_no_error_message():
    command = f"{sys.executable} -m irlpilco_ros.cli --help | true"
    done = subprocess.run(command, shell=True, capture_output=True, text=True)
    assert "Traceback" not in done.stderr
