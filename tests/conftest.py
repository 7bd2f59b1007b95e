"""Fixtures for every test: a ROS graph of one's own, with real processes and real DDS."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

# The same examples every time, however busy the machine is: a change is judged by what it changed.
# To search among others: pytest --hypothesis-profile=default
settings.register_profile(
    "repeatable", derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("repeatable")

REPOSITORY = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def repository() -> Path:
    """Top folder of the checkout."""
    return REPOSITORY


@pytest.fixture
def ros(tmp_path: Path) -> Iterator:
    """A ROS graph for one test (see ros_graph.RosGraph); every process must end with exit 0."""
    from ros_graph import RosGraph

    with RosGraph(tmp_path) as graph:
        yield graph


@pytest.fixture(scope="module")
def shared_ros(tmp_path_factory: pytest.TempPathFactory) -> Iterator:
    """A ROS graph that the tests of one module share, where starting nodes anew costs too much."""
    from ros_graph import RosGraph

    with RosGraph(tmp_path_factory.mktemp("ros")) as graph:
        yield graph
