"""Who may read what was recorded: its owner alone, unless the umask was chosen by somebody."""

from __future__ import annotations

import os
import stat

import pytest
from example_trajectories import demonstration

from irlpilco_ros.experience.private_folder import make_private
from irlpilco_ros.experience.run_directory import RunDirectory
from irlpilco_ros.experience.trajectory_bag import write_trajectory


@pytest.fixture
def umask():
    before = os.umask(0o022)
    yield os.umask
    os.umask(before)


def mode(path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


@pytest.mark.parametrize(
    ("mask", "expected"),
    [(0o022, 0o700), (0o002, 0o700), (0o077, 0o700), (0o027, 0o750), (0o007, 0o770), (0, 0o777)],
)
def test_a_umask_that_somebody_chose_decides(tmp_path, umask, mask, expected):
    umask(mask)
    make_private(tmp_path / "runs" / "sweep")
    assert mode(tmp_path / "runs") == expected
    assert mode(tmp_path / "runs" / "sweep") == expected


def test_a_folder_that_is_there_stays_as_its_owner_made_it(tmp_path, umask):
    (tmp_path / "shared").mkdir(mode=0o755)
    make_private(tmp_path / "shared")
    make_private(tmp_path / "shared" / "run")
    assert mode(tmp_path / "shared") == 0o755
    assert mode(tmp_path / "shared" / "run") == 0o700


def test_what_is_no_folder_is_an_error(tmp_path):
    (tmp_path / "file").touch()
    (tmp_path / "broken").symlink_to("nowhere")
    for name in ("file", "broken"):
        with pytest.raises(OSError, match="File exists"):
            make_private(tmp_path / name)
    with pytest.raises(OSError, match="Not a directory"):
        make_private(tmp_path / "file" / "run")


def test_recordings_and_runs_are_private(tmp_path, umask):
    shown = write_trajectory(tmp_path / "recordings", demonstration())
    with RunDirectory(tmp_path / "runs" / "sweep").claim({"horizon": 16}, shown) as run:
        assert mode(shown.parent) == mode(run.path) == 0o700
