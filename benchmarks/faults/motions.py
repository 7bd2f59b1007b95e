"""Faults in a trial: of the robot, of the controller, of others on the wire, of the user."""

from __future__ import annotations

import dataclasses
import itertools
import resource
import signal
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from malformed import malformed_payloads
from sensor_msgs.msg import JointState
from std_srvs.srv import SetBool

from benchmarks.faults.table import Fault, Outcome
from benchmarks.faults.workplace import CONTROLLER, ROBOT, Workplace, policy, workplace
from irlpilco_ros.experience.errors import BagError
from irlpilco_ros.experience.joint_state_cdr import decode
from irlpilco_ros.experience.recovery import recover
from irlpilco_ros.ros.messages import time_message
from irlpilco_ros.ros.qos import JOINT_COMMAND, JOINT_STATES_PUB

HELD_UP = 0.5  # [s]
DISK_LEFT = 8192  # bytes

INCURABLE = "kill -9 of the controller, for a receiver that holds"
"""Nobody is left to stop the robot: only what receives the commands can."""

Make = Callable[[Workplace], Any]


def spoilt(change: Callable[[JointState], None]) -> Make:
    """Return the fault that changes each of the robot's messages from now on."""

    def fault(place: Workplace) -> None:
        place.robot.wait_for_state()
        place.robot.distort = change

    return fault


def silent(place: Workplace) -> None:
    place.robot.wait_for_state()
    place.robot.is_silent = True


def without_wrist(message: JointState) -> None:
    lists = (message.name, message.position, message.velocity)
    kept = [i for i, name in enumerate(message.name) if name != "wrist"]
    message.name, message.position, message.velocity = (
        [values[i] for i in kept] for values in lists
    )


def standing_still(place: Workplace) -> None:
    place.robot.wait_for_state()
    last = time_message(place.robot.states[-1][0])

    def change(message: JointState) -> None:
        message.header.stamp = last

    place.robot.distort = change


def running_back(place: Workplace) -> None:
    place.robot.wait_for_state()
    last = place.robot.states[-1][0]
    steps = itertools.count(1)

    def change(message: JointState) -> None:
        message.header.stamp = time_message(last - 1_000_000 * next(steps))

    place.robot.distort = change


def zero_stamp(message: JointState) -> None:
    message.header.stamp = time_message(0)


def valued(value: float) -> Callable[[JointState], None]:
    """Return the change by which the elbow is at this position [rad]."""

    def change(message: JointState) -> None:
        message.position[message.name.index("elbow")] = value

    return change


def unequal(message: JointState) -> None:
    message.position = message.position[:-1]


def held_up(place: Workplace) -> float:
    place.controller.send(signal.SIGSTOP)
    time.sleep(HELD_UP)
    place.controller.send(signal.SIGCONT)
    return time.monotonic()


def signalled(number: int, process: str = "controller") -> Make:
    """Return the fault that sends a signal to a node."""

    def fault(place: Workplace) -> None:
        node = getattr(place, process)
        node.expected_code = None
        node.send(number)

    return fault


def set_parameters(values: dict[str, Any]) -> Make:
    """Return the fault that sets parameters of the controller."""
    return lambda place: assert_(place.ros.set_parameters("controller", values).successful)


def assert_(holds: bool) -> None:
    assert holds


def disabled(place: Workplace) -> None:
    place.ros.call(SetBool, "controller/enable", SetBool.Request(data=False))


def foreign_command(place: Workplace) -> float:
    publisher = place.ros.publisher(JointState, "joint_command", JOINT_COMMAND, subscribers=3)
    began = time.monotonic()
    publisher.publish(JointState(name=["elbow", "wrist"], velocity=[0.05, 0.05]))
    return began


def second_controller(place: Workplace) -> None:
    place.ros.start(CONTROLLER, parameters=ROBOT, wait=False)
    place.ros.wait_for(lambda: "second node" in place.controller.output, "a warning", 30.0)


def malformed(place: Workplace) -> None:
    publisher = place.ros.publisher(JointState, "joint_states", JOINT_STATES_PUB, subscribers=2)
    for payload in filter(_is_malformed, malformed_payloads(("elbow", "wrist"))):
        publisher.publish(payload)


def _is_malformed(payload: bytes) -> bool:
    try:
        decode(payload)
    except BagError:
        return True
    return False


ENDING: Sequence[tuple[str, Make]] = (
    ("the robot falls silent", silent),
    ("one joint falls silent", spoilt(without_wrist)),
    ("stamps stand still", standing_still),
    ("stamps are zero from now on", spoilt(zero_stamp)),
    ("stamps run back, 1 ms each", running_back),
    ("a position is NaN", spoilt(valued(float("nan")))),
    ("a position is beyond its limit", spoilt(valued(2.1))),
    ("lists of unequal length", spoilt(unequal)),
    (f"the controller is held up for {HELD_UP:g} s (SIGSTOP), from its return on", held_up),
    ("SIGTERM to the controller", signalled(signal.SIGTERM)),
    ("SIGINT to the controller", signalled(signal.SIGINT)),
    (INCURABLE, signalled(signal.SIGKILL)),
    ("`controller/stop`", lambda place: assert_(place.ros.trigger("controller/stop").success)),
    ("`controller/enable` false", disabled),
    ("the policy is changed", set_parameters(policy(0.2))),
    ("a guard is changed (`position_margin`)", set_parameters({"position_margin": 0.06})),
    ("somebody else publishes on `joint_command`", foreign_command),
)
"""Faults that a trial must be ended for."""

LASTING: Sequence[tuple[str, Make]] = (
    ("bytes on `joint_states` that are no message", malformed),
    ("a second controller starts", second_controller),
)
"""Faults that a trial goes on over."""


def in_trials(tries: int, say: Callable[[Fault], None]) -> None:
    """Make each fault so many times, and say what came of it."""
    for group, ends in ((ENDING, True), (LASTING, False)):
        for name, make in group:
            say(Fault(name, tuple(_try(make, ends) for _ in range(tries))))


def in_recordings(tries: int, say: Callable[[Fault], None]) -> None:
    """Kill the recorder, and fill its disk, while it records a trial."""
    say(Fault("kill -9 of the recorder", tuple(_killed() for _ in range(tries))))
    say(Fault("the recorder's disk is full", tuple(_filled() for _ in range(tries))))


def _try(make: Make, ends_trial: bool) -> Outcome:
    with workplace() as place:
        return place.run(make, ends_trial)


def _killed() -> Outcome:
    with workplace() as place:
        outcome = place.run(signalled(signal.SIGKILL, "recorder"), ends_trial=False)
        told = f"{outcome.told}; `irlpilco recover`: {_recovered(place.bag)}"
        return dataclasses.replace(outcome, told=told)


def _filled() -> Outcome:
    with workplace() as place:
        outcome = place.run(_fill_disk, ends_trial=False)
        told = f"{outcome.told}; `demonstration_recorder/stop`: {place.last_stop}"
        return dataclasses.replace(outcome, told=told)


def _fill_disk(place: Workplace) -> None:
    size = max(file.stat().st_size for file in place.bag.iterdir())
    limit = size + DISK_LEFT
    resource.prlimit(place.recorder.popen.pid, resource.RLIMIT_FSIZE, (limit, limit))


def _recovered(bag: Path) -> str:
    try:
        recovery = recover(bag)
    except BagError as error:
        return str(error)
    return f"{recovery.messages} messages, {'; '.join(recovery.notes)}"
