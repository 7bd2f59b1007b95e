"""The command line as a user meets it: help pages, wrong words, errors in one line."""

from __future__ import annotations

import os
import re
import subprocess
import sys

import pytest

from irlpilco_ros.cli import COMMANDS, build_parser, main


def help_page(capsys, *words):
    with pytest.raises(SystemExit) as stop:
        main([*words, "--help"])
    assert stop.value.code == 0
    return capsys.readouterr().out


def test_the_first_page_lists_every_command(capsys):
    page = help_page(capsys)
    assert " ".join(COMMANDS) == (
        "demo sweep learn train adapt report view plot replay export robot check inspect recover "
        "cart-pole study"
    )
    assert all(re.search(rf"\n    {name}\s", page) for name in COMMANDS)


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_a_page_with_examples_that_parse(capsys, name):
    page = help_page(capsys, name)
    _, _, examples = page.partition("examples:\n")
    lines = examples.replace("\\\n", " ").splitlines()
    commands = [line.partition("   ")[0] if line[:1] != " " else line.strip() for line in lines]
    own = [line.split("    ")[0].split()[1:] for line in commands if line.startswith("irlpilco ")]
    assert own
    for words in own:
        assert build_parser().parse_args(words).run


@pytest.mark.parametrize("name", COMMANDS)
def test_what_takes_long_to_import_is_imported_when_it_is_needed(name):
    """A second of a slow computer, for each command that one types, and for each node."""
    slow = {"scipy", "mujoco", "matplotlib", "rclpy"}
    program = (
        "import sys; from irlpilco_ros.cli import build_parser; "
        f"build_parser(['{name}']); print(*({slow} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert (done.returncode, done.stdout.split()) == (0, []), done.stderr


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


def test_the_version_is_that_of_the_package(capsys, repository):
    with pytest.raises(SystemExit) as stop:
        main(["--version"])
    assert stop.value.code == 0
    version = re.search("<version>(.*)</version>", (repository / "package.xml").read_text())
    assert version is not None
    assert capsys.readouterr().out == f"irlpilco {version[1]}\n"


@pytest.mark.parametrize("command", [["demo"], ["sweep"], ["learn"]])
def test_without_rclpy_it_says_what_to_do(tmp_path, command):
    (tmp_path / "rclpy.py").write_text("raise ModuleNotFoundError('no rclpy', name='rclpy')")
    done = subprocess.run(
        [sys.executable, "-m", "irlpilco_ros.cli", *command],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 1
    assert done.stderr.startswith("irlpilco: this command needs ROS 2")
    assert done.stderr.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir() if path.name != "__pycache__"] == ["rclpy.py"]


def test_an_rclpy_of_another_python_is_one_line(tmp_path):
    (tmp_path / "rclpy.py").write_text("raise ImportError('librcl.so: not found\\nread a page')")
    done = subprocess.run(
        [sys.executable, "-m", "irlpilco_ros.cli", "learn"],
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 1
    assert done.stderr.startswith(
        "irlpilco: a Python module cannot be loaded: librcl.so: not found;"
    )
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize("words", [["report"], ["demo", "--run-directory"]])
def test_a_path_through_a_file_is_one_line(capsys, tmp_path, words):
    (tmp_path / "file").touch()
    assert main([*words, str(tmp_path / "file" / "run")]) == 1
    errors = capsys.readouterr().err
    assert re.search(r"^irlpilco: .*file/run.*Not a directory", errors, re.MULTILINE)
    assert "Traceback" not in errors


@pytest.mark.parametrize(
    ("option", "file", "said"),
    [
        (
            "--settings",
            "baxter.yaml",
            "sets acceleration_limit, command_interface, effort_limit, joints",
        ),
        ("--robot", "sweep.yaml", "which do not belong in the robot's file"),
    ],
)
def test_a_settings_file_of_something_else_is_refused(
    capsys, tmp_path, monkeypatch, repository, option, file, said
):
    monkeypatch.chdir(tmp_path)
    assert main(["demo", option, str(repository / "config" / file)]) == 1
    errors = capsys.readouterr().err
    assert said in errors
    assert "Traceback" not in errors
    assert not list(tmp_path.iterdir())
