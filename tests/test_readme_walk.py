"""README's five shells and the sixth, as a person types it: what is learned is all that was shown.

Somebody who types needs a moment between two commands, so that the arms stand before and after the
motion in what is recorded. For learning the simulator waits for each command, so that the outcome
does not depend on how busy the computer is.
"""

from __future__ import annotations

import re
import time
from pathlib import Path

import numpy as np
import pytest
from ros_graph import REPOSITORY

from irlpilco_ros.experience.bag_reader import read_path
from irlpilco_ros.experience.motion import MotionSettings, find_motion
from irlpilco_ros.experience.path_quality import MotionPath, accelerations
from irlpilco_ros.experience.run_directory import RunDirectory

pytestmark = pytest.mark.dds

PAUSE = 1.5
"""How long it takes to type a command and to have it answered [s]."""

PACES = (2.0, 1.0, 0.5, 0.25)
"""Of the robot's time against the wall clock, until the arms are moved as by a hand.

On a busy computer the demonstrator speaks late and the arms jerk after it: it gets more time then.
"""

SOFT = 5.0
"""Acceleration of a joint that no jerk exceeds [rad/s^2]; the sweep's own is 2.2."""


def sixth_shell() -> list[str]:
    """Return the commands by which README shows the task."""
    text = (REPOSITORY / "README.md").read_text(encoding="utf-8")
    block = re.search(r"In a sixth, show the task once.*?```sh\n(.*?)```", text, re.DOTALL)
    assert block is not None
    return block.group(1).strip().splitlines()


def start_simulator(ros, **pace):
    """Start the robot; the first shell."""
    return ros.start(
        "sim_bridge.baxter_simulator_node",
        files=["config/baxter_simulator.yaml"],
        parameters={"debris": 0, **pace},
    )


def start_others(ros, folder: Path) -> None:
    """Start the nodes of the other four shells."""
    baxter, own = "config/baxter.yaml", "config/baxter_simulator.yaml"
    run = {"run_directory": str(folder / "run")}
    recordings = {"output_directory": str(folder / "recordings")}
    nodes = "irlpilco_ros.nodes"
    ros.start(f"{nodes}.controller", files=[baxter], wait=False)
    ros.start(f"{nodes}.demonstration_recorder", files=[baxter], parameters=recordings, wait=False)
    ros.start(f"{nodes}.learner", files=[baxter, "config/sweep.yaml"], parameters=run, wait=False)
    ros.start("sim_bridge.demonstrator_node", files=[own], wait=False)
    for name in ("controller", "demonstration_recorder", "learner", "demonstrator"):
        ros.wait_for_node(name, timeout=60.0)


class RefusedError(AssertionError):
    """A node did not do what was typed."""


def type_in(ros, command: str, folder: Path) -> str:
    """Do what a command of README does, in a folder; return what it answers."""
    time.sleep(PAUSE)
    call = re.fullmatch(r"ros2 service call /(\S+) std_srvs/srv/Trigger(?: *#.*)?", command)
    if call is not None:
        answer = ros.trigger(call.group(1), timeout=120.0)
        if not answer.success:
            raise RefusedError(answer.message)
        return str(answer.message)
    setting = re.fullmatch(r"ros2 param set /(\S+) (\S+) \$PWD/(\S+)", command)
    assert setting is not None, f"README has a command that is not known here: {command}"
    node, name, value = setting.groups()
    result = ros.set_parameters(node, {name: str(folder / value)})
    assert result.successful, result.reason
    return str(folder / value)


def show(ros, commands: list[str], folder: Path) -> tuple[str, float]:
    """Type what shows the task; return what the recorder says at the end, and the robot's pace."""
    start_others(ros, folder)
    told = []
    for pace in PACES:
        try:
            stopped = show_at(ros, pace, commands, folder)
        except RefusedError as refused:
            told.append(str(refused))
        else:
            hardness = hardest(bag_of(stopped))
            if hardness < SOFT:
                return stopped, pace
            told.append(f"a joint jerked by {hardness:.1f} rad/s^2")
        if (folder / "recordings").exists():
            (folder / "recordings").rename(folder / f"recordings at {pace}")
    raise AssertionError(told)


def show_at(ros, pace: float, commands: list[str], folder: Path) -> str:
    """Type what shows the task to a robot of this pace; return what the recorder says at the end.

    Raises:
        RefusedError: a node could not do its part.
    """
    robot = start_simulator(ros, real_time_factor=pace)
    try:
        return [type_in(ros, command, folder) for command in commands][-1]
    finally:
        ros.trigger("demonstration_recorder/stop")
        assert robot.stop() == 0
        ros.wait_until_gone("baxter_simulator")


def bag_of(stopped: str) -> Path:
    """Return the bag that the recorder's answer names."""
    return Path(stopped.rpartition("bag: ")[2])


def hardest(bag: Path) -> float:
    """Return the largest acceleration of a joint in a bag [rad/s^2]."""
    shown = read_path(bag)
    times = shown.stamps - shown.stamps[0]
    return float(np.abs(accelerations(MotionPath(times, shown.positions, shown.velocities))).max())


def test_what_is_typed_in_the_sixth_shell_is_learned_from_onset_to_end(ros, tmp_path):
    *showing, choosing = sixth_shell()
    stopped, pace = show(ros, showing, tmp_path)
    type_in(ros, choosing, tmp_path)
    start_simulator(ros, lockstep=True)
    for _ in range(2):
        type_in(ros, "ros2 service call /learn_iteration std_srvs/srv/Trigger", tmp_path)

    shown = read_path(bag_of(stopped))
    motion = find_motion(shown.stamps, shown.positions, shown.joint_names, MotionSettings())
    assert motion is not None
    stood = PAUSE * min(pace, 1.0)
    assert motion.begin > stood, "it stood before the motion"
    assert motion.recorded - motion.end > stood, "and after it"
    told = re.search(r"from ([\d.]+) s to ([\d.]+) s of ([\d.]+) s", stopped)
    assert told is not None, stopped
    np.testing.assert_allclose(
        [float(each) for each in told.groups()],
        [motion.begin, motion.end, motion.recorded],
        atol=0.3,
    )

    run = RunDirectory(tmp_path / "run")
    last = run.metrics()[2]
    trial = read_path(run.trials_directory / f"{last.trial:03d}")
    done = trial.stamps[trial.commanded]
    assert done[-1] - done[0] >= motion.duration - 0.1, "all of it is done"
    assert last.rmse_rad <= 0.004
    there = trial.positions[trial.stamps <= done[-1]][-1, trial.columns(shown.joint_names)]
    np.testing.assert_allclose(there, shown.positions[-1], atol=0.005)
    first = trial.positions[trial.stamps >= done[0]][0, trial.columns(shown.joint_names)]
    np.testing.assert_allclose(first, shown.positions[0], atol=0.01)
