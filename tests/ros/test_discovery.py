"""Who finds a node: this computer alone, unless somebody opens it on purpose."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from irlpilco_ros.ros.discovery import PEERS, PROFILES, RANGE, is_open, keep_to_this_host, warning

MINIMAL = str(Path(__file__).with_name("minimal_node.py"))


@pytest.fixture
def closed(repository):
    return {RANGE: "SYSTEM_DEFAULT", PROFILES[0]: str(repository / "config/this_host.xml")}


@pytest.mark.parametrize("asked", [None, "", "SUBNET", "LOCALHOST"])
def test_what_nobody_chose_and_this_host_mean_loopback_alone(asked, closed):
    environment = {} if asked is None else {RANGE: asked}
    assert keep_to_this_host(environment) == (asked == "SUBNET")  # as ROS's own setup.bash says
    assert environment == closed
    assert not keep_to_this_host(environment), "what is inherited stays as it is"
    assert environment == closed
    assert not warning(environment)


def test_what_another_installation_of_this_package_set_is_kept():
    """As when `ros2 launch` finds another one than the nodes that it starts."""
    environment = {RANGE: "SYSTEM_DEFAULT", PROFILES[0]: "/elsewhere/this_host.xml"}
    before = dict(environment)
    assert not is_open(environment)
    keep_to_this_host(environment)
    assert not warning(environment)
    assert environment[RANGE] == before[RANGE]


@pytest.mark.parametrize("chosen", ["OFF", "SYSTEM_DEFAULT"])
def test_another_range_is_a_choice(chosen):
    environment = {RANGE: chosen}
    assert not keep_to_this_host(environment)
    assert environment == {RANGE: chosen}


@pytest.mark.parametrize(
    "also",
    [
        {PEERS: "192.168.0.7"},
        {"RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp"},
        {"ROS_LOCALHOST_ONLY": "1"},
        {PROFILES[0]: "mine.xml"},
        {PROFILES[1]: "mine.xml"},
    ],
)
def test_what_does_not_go_with_the_profile_stays_and_the_range_is_narrow(also):
    environment = {RANGE: "SUBNET", **also}
    keep_to_this_host(environment)
    assert environment == {RANGE: "LOCALHOST", **also}


def test_an_open_node_is_warned_of_unless_strangers_are_refused():
    environment = {RANGE: "SYSTEM_DEFAULT", "ROS_SECURITY_ENABLE": "true"}
    assert is_open(environment)
    assert "may command this node" in warning(environment)
    assert not warning({**environment, "ROS_SECURITY_STRATEGY": "Enforce"})


def addresses(pid: int) -> set[str]:
    """Return the addresses at which a process takes datagrams, such as "127.0.0.1"."""
    own = {os.readlink(each) for each in Path(f"/proc/{pid}/fd").iterdir() if each.is_symlink()}
    found = set()
    for line in Path("/proc/net/udp").read_text().splitlines()[1:]:
        words = line.split()
        if f"socket:[{words[9]}]" in own:
            number = bytes.fromhex(words[1].partition(":")[0])
            found.add(".".join(str(byte) for byte in reversed(number)))
    return found


@pytest.mark.dds
@pytest.mark.parametrize(
    ("asked", "at", "said"),
    [
        ("", {"127.0.0.1", "239.255.0.1"}, ""),
        ("SUBNET", {"127.0.0.1", "239.255.0.1"}, "only this computer finds this node"),
        ("SYSTEM_DEFAULT", {"0.0.0.0"}, "whoever is on the network may command this node"),
    ],
)
def test_a_node_has_sockets_that_a_network_reaches_only_if_it_is_told_to(ros, asked, at, said):
    ros.environment[RANGE] = asked
    for name in PROFILES:
        ros.environment.pop(name, None)
    process = ros.run([sys.executable, MINIMAL])
    ros.wait_for_node("minimal", process)
    found = addresses(process.popen.pid)
    assert found <= at if "127.0.0.1" in at else at <= found
    ros.wait_for(lambda: said in process.output and "running" in process.output, said)
    assert bool(said) == ("computer" in process.output or "network" in process.output)


@pytest.mark.dds
@pytest.mark.parametrize("asked", ["LOCALHOST", "SUBNET"])
def test_the_ros2_command_finds_the_nodes_whatever_it_was_told(ros, tmp_path, asked):
    """Here another process that knows nothing of this package stands for it."""
    process = ros.run([sys.executable, MINIMAL])
    ros.wait_for_node("minimal", process)
    environment = {RANGE: asked}
    caller = tmp_path / "caller.py"
    caller.write_text(
        "import rclpy\n"
        "from std_srvs.srv import Trigger\n"
        "rclpy.init()\n"
        "node = rclpy.create_node('caller')\n"
        "client = node.create_client(Trigger, '/minimal/settings')\n"
        "assert client.wait_for_service(20.0)\n"
        "answer = client.call_async(Trigger.Request())\n"
        "rclpy.spin_until_future_complete(node, answer, timeout_sec=20.0)\n"
        "print(answer.result().message)\n"
    )
    ros.environment |= environment
    for name in PROFILES:
        ros.environment.pop(name, None)
    call = ros.run([sys.executable, str(caller)], log="caller.log")
    assert call.wait(60.0) == 0
    assert "gain=1.0" in call.output
