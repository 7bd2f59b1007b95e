"""Calls between nodes: from async callbacks, with time limits and readable errors."""

from __future__ import annotations

import signal
import sys
import threading
import time
from pathlib import Path

import pytest

from irlpilco_ros.ros.clients import ServiceError
from irlpilco_ros.ros.context import RosStartError
from irlpilco_ros.ros.session import Session

pytestmark = pytest.mark.dds
MINIMAL = str(Path(__file__).with_name("minimal_node.py"))


@pytest.fixture(scope="module")
def graph(shared_ros):
    shared_ros.run(
        [sys.executable, MINIMAL, "--ros-args", "-p", "gain:=2.5", "-p", "dawdling:=20.0"],
        "minimal.log",
    )
    shared_ros.wait_for_node("minimal")
    return shared_ros


@pytest.fixture(scope="module")
def other(graph):
    graph.run([sys.executable, MINIMAL, "--ros-args", "-r", "__node:=other"], "other.log")
    graph.wait_for_node("other")


def test_a_service_that_is_not_there_is_named(graph):
    answer = graph.trigger("minimal/ask")
    assert not answer.success
    assert "service other/set_parameters_atomically is not there" in answer.message


def test_a_callback_sets_parameters_of_another_node_and_calls_it(graph, other):
    answer = graph.trigger("minimal/ask")
    assert answer.success, answer.message
    assert "gain=2.5" in answer.message


def test_an_answer_that_does_not_come_in_time_is_an_error_and_the_node_stays_responsive(graph):
    assert graph.trigger("minimal/settings").success  # from here on the service is known
    waiting = graph.trigger_async("minimal/wait")
    began = time.monotonic()
    assert graph.trigger("minimal/settings").success
    assert not waiting.done()
    graph.wait_for(waiting.done, "the answer")
    assert time.monotonic() - began < 15.0
    assert "minimal/dawdle did not answer within 0.3 s" in waiting.result().message


def test_the_command_line_gets_the_message_or_the_reason(graph, other, monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", str(graph.domain))
    with Session("caller") as caller:
        clients = caller.clients
        caller.run(clients.set_parameters("other", {"gain": 3.5, "limits": (1.0, 2.0)}))
        message = caller.trigger("other/settings", 5.0)
        assert "gain=3.5" in message
        assert "limits=(1.0, 2.0)" in message
        with pytest.raises(ServiceError, match=r"other refused the parameters: .*valid values"):
            caller.run(clients.set_parameters("other", {"mode": "loud"}))
        with pytest.raises(ServiceError, match=r"other/dawdle did not answer within 0\.2 s"):
            caller.trigger("other/dawdle", 0.2)
        with pytest.raises(ServiceError, match="nobody/there is not there"):
            caller.run(clients.trigger("nobody/there", 1.0, wait=0.2))


def test_nodes_are_met_when_they_answer(graph, other, monkeypatch):
    """Their services may be there long before: here the process is stopped for a while."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(graph.domain))
    (process,) = (each for each in graph.processes if "__node:=other" in each.command)
    needed = {"other": ("other/settings", "other/warn")}
    with Session("caller") as caller:
        caller.wait_for_nodes(needed, 20.0)
        process.send(signal.SIGSTOP)
        try:
            with pytest.raises(ServiceError, match="other/get_parameters did not answer"):
                caller.wait_for_nodes(needed, 0.5)
            threading.Timer(1.0, lambda: process.send(signal.SIGCONT)).start()
            began = time.monotonic()
            caller.wait_for_nodes(needed, 20.0)
            assert time.monotonic() - began > 0.9
        finally:
            process.send(signal.SIGCONT)
        with pytest.raises(ServiceError, match="other/nothing is not there"):
            caller.wait_for_nodes({"other": ("other/nothing",)}, 0.5)


def test_parameters_of_another_node_are_read(graph, other, monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", str(graph.domain))
    with Session("caller") as caller:
        clients = caller.clients
        read = caller.run(clients.get_parameters("minimal", ("gain", "mode")))
        assert read == {"gain": 2.5, "mode": "slow"}
        with pytest.raises(ServiceError, match="minimal lacks one of the parameters gain, nothing"):
            caller.run(clients.get_parameters("minimal", ("gain", "nothing")))


def test_a_namespace_that_is_none_is_a_sentence(graph, monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", str(graph.domain))
    with pytest.raises(RosStartError, match=r"namespace must not contain .* '/a b'$"):
        Session("caller", namespace="a b")
    monkeypatch.setenv("ROS_DOMAIN_ID", "seven")
    with pytest.raises(RosStartError, match="ROS_DOMAIN_ID is not an integral number"):
        Session("caller")
