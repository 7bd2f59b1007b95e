"""The package as `pip install .` leaves it, in the layout that `ros2 run` looks for."""

from __future__ import annotations

import configparser
import os
import re
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
import yaml

from irlpilco_ros import __version__

NODES = (
    "demonstration_recorder",
    "learner",
    "controller",
    "baxter_simulator",
    "cart_pole_simulator",
    "demonstrator",
)


def run(*command: object, **options: Any) -> str:
    """Run a command to its end and return what it printed; it must succeed."""
    result = subprocess.run(
        [str(word) for word in command], capture_output=True, text=True, check=False, **options
    )
    assert result.returncode == 0, f"{command} failed:\n{result.stdout}\n{result.stderr}"
    return str(result.stdout)


@pytest.fixture(scope="module")
def source(repository: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the checkout, without what git ignores: building must not litter the original."""
    listing = run("git", "ls-files", "--cached", "--others", "--exclude-standard", cwd=repository)
    copy = tmp_path_factory.mktemp("source")
    for name in filter(lambda name: (repository / name).is_file(), listing.splitlines()):
        (copy / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(repository / name, copy / name)
    return copy


@pytest.fixture(scope="module")
def prefix(source: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A virtual environment in which the package was installed by `pip install .`."""
    prefix = tmp_path_factory.mktemp("prefix") / "environment"
    run(sys.executable, "-m", "venv", "--without-pip", prefix)
    python = prefix / "bin" / "python3"
    site = Path(run(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))").strip())
    # What the package needs comes from the environment of the tests, behind its own site-packages.
    behind = sysconfig.get_path("purelib")
    (site / "tests.pth").write_text(f"import site; site.addsitedir({behind!r})\n")
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check", "--python", python)
    run(*pip, "install", "--quiet", "--no-deps", "--no-index", "--no-build-isolation", source)
    return prefix


@pytest.fixture
def environment(prefix: Path) -> dict[str, str]:
    """The environment variables of somebody who told ROS of the prefix."""
    environment = {**os.environ, "AMENT_PREFIX_PATH": str(prefix)}
    environment.pop("PYTHONPATH", None)
    return environment


def test_version_and_license_are_the_same_everywhere(repository):
    package = ElementTree.parse(repository / "package.xml")
    setup = configparser.ConfigParser()
    setup.read(repository / "setup.cfg")
    citation = yaml.safe_load((repository / "CITATION.cff").read_text(encoding="utf-8"))
    for key in ("name", "version", "license"):
        value = package.findtext(key)
        assert value == (__version__ if key == "version" else setup["metadata"][key])
        assert value == citation["title" if key == "name" else key]


def test_colcon_can_build_with_the_setuptools_beside_a_ros_from_apt(repository):
    """colcon-core wants less than 80, which has no `develop --editable` (--symlink-install)."""
    pins = dict(
        line.partition(" ;")[0].split("==")
        for line in (repository / "requirements/system-ros.lock").read_text().splitlines()
    )
    wanted = (repository / "requirements/colcon.in").read_text().splitlines()[-1]
    assert wanted == "setuptools<80"
    assert int(pins["setuptools"].partition(".")[0]) < 80
    assert re.search(r"system-ros\.lock .*\bcolcon\.in", (repository / "tools/lock.sh").read_text())


def test_the_package_is_in_the_ament_index(prefix, environment, tmp_path):
    code = (
        "from ament_index_python.packages import *; "
        "print(get_package_prefix('irlpilco_ros'), get_package_share_directory('irlpilco_ros'))"
    )
    found = run(prefix / "bin/python3", "-c", code, env=environment, cwd=tmp_path).split()
    assert found == [str(prefix), str(prefix / "share/irlpilco_ros")]
    assert (prefix / "share/irlpilco_ros/package.xml").is_file()


def test_executables_are_where_ros2_run_looks(prefix):
    folder = prefix / "lib/irlpilco_ros"
    found = {path.name for path in folder.iterdir() if os.access(path, os.X_OK)}
    assert found == {*NODES, "irlpilco"}


def test_parameter_files_and_launch_files_are_installed(prefix, repository):
    share = prefix / "share/irlpilco_ros"
    for folder in ("config", "launch"):
        originals = {path.name: path.read_bytes() for path in (repository / folder).glob("*.*")}
        installed = {path.name: path.read_bytes() for path in (share / folder).glob("*.*")}
        assert installed == originals
        assert installed


def test_installed_code_finds_its_own_files(prefix, environment, tmp_path):
    code = (
        "import irlpilco_ros, sim_bridge; from irlpilco_ros.resources import config_file; "
        "print(irlpilco_ros.__file__, sim_bridge.__file__, config_file('baxter.yaml'))"
    )
    found = run(prefix / "bin/python3", "-c", code, env=environment, cwd=tmp_path).split()
    assert all(path.startswith(f"{prefix}/") for path in found)


def test_every_file_of_the_packages_is_installed(prefix, source):
    """Models, demonstrations and templates too, not the Python files alone."""

    def files(folder: Path) -> set[str]:
        return {
            str(path.relative_to(folder))
            for package in ("irlpilco_ros", "sim_bridge")
            for path in (folder / package).rglob("*")
            if path.is_file() and path.suffix != ".pyc"
        }

    site = Path(sysconfig.get_path("purelib", vars={"base": str(prefix)}))
    assert "sim_bridge/models/baxter/baxter.xml" in files(site)
    assert files(site) == files(source)


@pytest.mark.parametrize("command", ["bin/irlpilco", "lib/irlpilco_ros/irlpilco"])
def test_the_command_is_on_the_path_and_where_ros2_run_looks(
    prefix, environment, tmp_path, command
):
    assert "demo" in run(prefix / command, "--help", env=environment, cwd=tmp_path)


def test_config_is_found_in_a_checkout(repository):
    from irlpilco_ros.resources import MissingResourceError, config_directory, config_file

    assert config_directory() == repository / "config"
    with pytest.raises(MissingResourceError, match=r"'other\.yaml'.*available: .*baxter\.yaml"):
        config_file("other.yaml")


@pytest.mark.dds
def test_the_very_files_of_ros2_run_start_their_nodes(ros, prefix, environment, repository):
    """Also when started inside a checkout they run the installed code; they end in good order."""
    ros.environment["PYTHONVERBOSE"] = "1"  # says where each module comes from
    del ros.environment["PYTHONPATH"]
    config = prefix / "share/irlpilco_ros/config/baxter.yaml"
    nodes = {
        name: ros.run(
            [str(prefix / "lib/irlpilco_ros" / name), "--ros-args", "--params-file", str(config)],
            log=f"{name}.log",
        )
        for name in NODES
    }
    for name, process in nodes.items():
        ros.wait_for_node(name, process, timeout=30.0)
        assert f"{prefix}/lib/" in process.output
        assert f"{repository}/irlpilco_ros/" not in process.output
