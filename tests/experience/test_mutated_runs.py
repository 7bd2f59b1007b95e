"""Run directories that are damaged: opened, or refused in a sentence; nothing is lost."""

from __future__ import annotations

import os
import random
import shutil
import time
import zipfile

import numpy as np
import pytest
import toy_robot
import yaml
from damaged_bags import BYTES, mutate_tree
from test_mutations import LONGEST

from irlpilco_ros.experience.apprenticeship import Apprenticeship
from irlpilco_ros.experience.errors import RunDirectoryError
from irlpilco_ros.experience.inspect import inspect
from irlpilco_ros.experience.parameters_file import load_parameters_file
from irlpilco_ros.experience.run_directory import RunDirectory
from irlpilco_ros.learning.errors import InvalidSettingError, IrlPilcoError
from irlpilco_ros.learning.learning_settings import LearningSettings

SETTINGS = LearningSettings(evaluations=8, options={"linear_phase.count": 3})


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    return toy_robot.record_run(tmp_path_factory.mktemp("mutated"), SETTINGS, 2, planned=True)


@pytest.fixture
def copy(finished, tmp_path):
    return shutil.copytree(finished, tmp_path / "copy")


def read_everything(path):
    """What the learner, the report and the command line read of a run."""
    inspect(path)
    run = RunDirectory(path)
    run.metrics()
    run.configuration()
    for iteration in run.iterations():
        run.read_iteration(iteration)
        run.read_policy(iteration)


def open_run(path):
    Apprenticeship.open(path, None, toy_robot.ROBOT, SETTINGS).close()


def refusal(command, path) -> str:
    """Return what a command says if it refuses; nothing if it does what it should."""
    began = time.monotonic()
    try:
        command(path)
    except IrlPilcoError as error:
        return str(error) or "refused without a word"
    finally:
        assert time.monotonic() - began < LONGEST
    return ""


@pytest.mark.parametrize(
    "pattern", ["config.yaml", "metrics.csv", "iterations/*.npz", "policy_*.yaml"]
)
def test_a_damaged_file_is_read_or_refused_in_a_sentence(finished, tmp_path, pattern):
    rng = random.Random(pattern)
    refused = 0
    for number in range(40):
        path = shutil.copytree(finished, tmp_path / str(number))
        file = rng.choice(sorted(path.glob(pattern)))
        if file.suffix == ".yaml" and rng.random() < 0.5:
            file.write_text(yaml.safe_dump(mutate_tree(yaml.safe_load(file.read_text()), rng)))
        else:
            content = bytearray(file.read_bytes())
            rng.choice(BYTES)(content, rng)
            file.write_bytes(content)
        before = {each: each.read_bytes() for each in path.rglob("*.mcap")}
        refused += bool(refusal(read_everything, path)) + bool(refusal(open_run, path))
        assert {each: each.read_bytes() for each in path.rglob("*.mcap")} == before
        shutil.rmtree(path)
    assert refused


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("config.yaml", b"\xff\xfe"),
        ("config.yaml", b"- a\n- list\n"),
        ("config.yaml", b"a: &a [1, 2]\nb: [*a, *a]\n"),
        ("metrics.csv", b"\xff\xfe"),
        ("metrics.csv", b""),
        ("policy_001.yaml", b"/**:\n  ros__parameters:\n  - a list\n"),
        ("policy_001.yaml", b"/**: 3\n"),
        ("iterations/001.npz", b"PK\x03\x04"),
        ("iterations/001.npz", b""),
    ],
)
def test_what_makes_no_sense_is_refused_by_name(copy, name, content):
    (copy / name).write_bytes(content)
    assert name in refusal(read_everything, copy)


def fifo(path):
    os.mkfifo(path)


def endless(path):
    path.symlink_to("/dev/zero")


def loop(path):
    path.symlink_to(path.name)


def huge(path):
    with path.open("wb") as stream:
        stream.truncate(1 << 34)


ODD = {
    "nothing": lambda path: None,
    "a FIFO": fifo,
    "an endless device": endless,
    "a link to itself": loop,
    "a link to nothing": lambda path: path.symlink_to("nowhere"),
    "a folder": lambda path: path.mkdir(),
    "16 GB": huge,
}


@pytest.mark.parametrize("kind", ODD)
def test_what_is_no_file_hangs_and_ends_nobody(copy, kind):
    kept = {each: each.read_bytes() for each in copy.rglob("*.mcap")}
    for name in ("config.yaml", "metrics.csv", "policy_001.yaml", "iterations/001.npz", ".lock"):
        file = copy / name
        file.rename(copy / "aside")
        ODD[kind](file)
        refusal(inspect, copy)
        refusal(open_run, copy)
        refused = refusal(read_everything, copy)
        if kind != "nothing" and name != ".lock":
            assert name in refused
        if file.is_dir() and not file.is_symlink():
            file.rmdir()
        else:
            file.unlink(missing_ok=True)
        (copy / "aside").rename(file)
    assert {each: each.read_bytes() for each in copy.rglob("*.mcap")} == kept


def test_files_that_nobody_asked_for_are_in_nobodys_way(copy):
    for name in ("7 copy.npz", "backup.npz", "-1.npz", "01.npz"):
        shutil.copy(copy / "iterations" / "001.npz", copy / "iterations" / name)
    for name in ("policy_001 copy.yaml", "policy_.yaml", "policy_1e3.yaml"):
        shutil.copy(copy / "policy_001.yaml", copy / name)
    (copy / "trials" / "7").mkdir()
    (copy / "trials" / "notes.txt").write_text("mine")
    assert RunDirectory(copy).iterations() == (1, 2)
    assert refusal(open_run, copy) == ""
    assert refusal(read_everything, copy) == ""


def test_an_iteration_that_unpacks_to_gigabytes_is_refused(copy):
    with (
        zipfile.ZipFile(copy / "iterations" / "001.npz", "w", zipfile.ZIP_DEFLATED) as archive,
        archive.open("weights.npy", "w", force_zip64=True) as member,
    ):
        header = {"descr": "<f8", "fortran_order": False, "shape": (1 << 26,)}
        np.lib.format.write_array_header_1_0(member, header)
        for _ in range(17):
            member.write(bytes(1 << 24))
    with pytest.raises(RunDirectoryError, match=r"unpacks to \d+ bytes"):
        RunDirectory(copy).read_iteration(1)


def test_folders_that_cannot_be_written_are_named(tmp_path):
    (tmp_path / "file").write_text("no folder")
    shown = toy_robot.record_demonstration(tmp_path / "shown")
    with pytest.raises(RunDirectoryError, match=r"cannot write to the run directory .*/run: "):
        Apprenticeship.open(tmp_path / "file" / "run", shown, toy_robot.ROBOT, SETTINGS)


def test_a_yaml_bomb_in_a_parameter_file_is_refused(tmp_path):
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]" for k in range(1, 12)]
    for text in ("\n".join(lines), "[" * 100_000, "x: " + "1" * 5000, "a: 2020-99-99", "\x00"):
        (tmp_path / "bomb.yaml").write_text(text)
        with pytest.raises(InvalidSettingError, match=r"bomb\.yaml"):
            load_parameters_file(tmp_path / "bomb.yaml", "learner")
    with (tmp_path / "bomb.yaml").open("wb") as stream:
        stream.truncate(1 << 30)
    with pytest.raises(InvalidSettingError, match="too large"):
        load_parameters_file(tmp_path / "bomb.yaml", "learner")
    with pytest.raises(InvalidSettingError, match="no regular file"):
        load_parameters_file("/dev/zero", "learner")
