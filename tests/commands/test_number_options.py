"""Every number on the command line: what cannot be meant is a sentence and exit code 2."""

from __future__ import annotations

import argparse
from pathlib import Path

import pytest

from irlpilco_ros.cli import build_parser, main

WHOLE = ("nan", "inf", "1.5", "many", "", "-1", "1" + 30 * "0", 5000 * "9")
REAL = ("nan", "inf", "-inf", "1e400", "1e9", "-1e9", "much", "", 5000 * "9")
OPTIONS = {
    "demo --seed": WHOLE,
    "demo --iterations": WHOLE,
    "demo --moved-trials": WHOLE,
    "demo --control-period": (*REAL, "0", "-0.1"),
    "demo --speed-factor": (*REAL, "-1", "4"),
    "demo --command-lag": (*REAL, "-2", "2"),
    "demo --position-margin": (*REAL, "-2", "2"),
    "demo --real-time-factor": (*REAL, "-1"),
    "sweep --iterations": (*WHOLE, "0"),
    "learn --iterations": (*WHOLE, "0"),
    "train --object-pose": REAL,
    "train --speed": (*REAL, "0", "-1", "2"),
    "train --demonstration-window": (*REAL, "-1"),
    "adapt --object-pose": REAL,
    "adapt --speed": (*REAL, "0", "-1", "2"),
    "adapt --error-limit": (*REAL, "-1"),
    "view --port": (*WHOLE, "65536", "99999"),
    "inspect --demonstration-window": (*REAL, "-1"),
    "replay --demonstration-window": (*REAL, "-1"),
    "check --seconds": (*WHOLE, "0"),
    "cart-pole --seeds": (*WHOLE, "0"),
    "cart-pole --first-seed": WHOLE,
    "cart-pole --iterations": (*WHOLE, "0"),
    "cart-pole --expert-trials": (*WHOLE, "0"),
    "study --seeds": (*WHOLE, "0"),
    "study --iterations": (*WHOLE, "0"),
    "study --processes": (*WHOLE, "0"),
}
WORDS = (None, str, Path)


def numbers(parser):
    """Yield command, option and number of values of every option that is no word and no path."""
    chosen = next(a for a in parser._actions if isinstance(a, argparse._SubParsersAction))
    for command, page in chosen.choices.items():
        for action in page._actions:
            if action.type not in WORDS:
                yield f"{command} {action.option_strings[0]}", action.nargs


def test_the_table_has_every_number():
    assert {name for name, _ in numbers(build_parser())} == set(OPTIONS)


@pytest.mark.parametrize("name", OPTIONS)
def test_what_cannot_be_meant_is_wrong_usage(capsys, name):
    command, option = name.split()
    count = dict(numbers(build_parser()))[name]
    for text in OPTIONS[name]:
        values = [text] * (count if isinstance(count, int) else 1)
        # As one word, or a minus would be taken for another option.
        words = [option, *values] if len(values) > 1 else [f"{option}={text}"]
        with pytest.raises(SystemExit) as stop:
            main([command, *words])
        assert stop.value.code == 2, (name, text)
        said = capsys.readouterr().err.splitlines()[-1]
        assert f"argument {option}: " in said
        assert "will not do; expected a " in said or f"expected {count} arguments" in said
        assert len(said) < 250


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--speed-factor", "1", "1"], "speed_factor has 2 values; expected 1 for all joints"),
        (["--moved", "places.yaml"], "places.yaml holds no places"),
    ],
)
def test_numbers_that_do_not_fit_each_other_start_nothing(
    capsys, tmp_path, monkeypatch, words, said
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "places.yaml").write_text("- [0.1, .nan, 0.0]\n")
    assert main(["demo", *words]) == 1
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
    assert not (tmp_path / "runs").exists()
