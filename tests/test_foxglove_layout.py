"""config/foxglove_layout.json asks for nothing that is not published, as it is published."""

from __future__ import annotations

import importlib
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from irlpilco_ros.experience.parameters_file import load_parameters_file
from sim_bridge.joints import PUBLISHED_JOINTS

ROOT = Path(__file__).resolve().parent.parent
LAYOUT = json.loads((ROOT / "config" / "foxglove_layout.json").read_text(encoding="utf-8"))
PANELS: dict[str, dict[str, Any]] = LAYOUT["configById"]
OF_ROS = {"/rosout": "rcl_interfaces/msg/Log"}
"""What every node of ROS 2 publishes by itself."""
SEQUENCE = re.compile(r"(?:sequence<(?P<many>[^,>]+)[^>]*>|(?P<few>[^\[]+)\[\d+\])$")


def type_of(topic: str) -> str:
    """Return the type of a topic by its page in msgs_docs/; test_docs compares pages with nodes."""
    page = ROOT / "msgs_docs" / f"{topic.strip('/').replace('/', '.')}.md"
    if topic in OF_ROS:
        return OF_ROS[topic]
    assert page.is_file(), f"{topic} is published by nobody"
    found = re.search(r"^\| type \| `(.+)` \|$", page.read_text(encoding="utf-8"), re.MULTILINE)
    assert found is not None
    return found[1]


def resolve(path: str) -> str:
    """Return the type of what a message path leads to, such as "double"."""
    topic, *steps = re.findall(r"^[\w/]+|\.\w+|\[\d+\]", path)
    assert "".join([topic, *steps]) == path, f"{path} is no message path"
    kind = type_of(topic)
    for step in steps:
        if step.startswith("["):
            elements = SEQUENCE.match(kind)
            assert elements is not None, f"{path}: {kind} has no elements"
            kind = elements["many"] or elements["few"]
        else:
            kind = fields_of(kind)[step[1:]]
    return kind


def fields_of(kind: str) -> dict[str, str]:
    """Return the fields of a message type, name -> type."""
    package, name = kind.split("/")[0], kind.split("/")[-1]
    message = getattr(importlib.import_module(f"{package}.msg"), name)
    fields: dict[str, str] = message.get_fields_and_field_types()
    return fields


def shown(node: Any) -> Iterator[str]:
    """Return the panels of a layout's tree."""
    if isinstance(node, str):
        yield node
        return
    assert node["direction"] in {"row", "column"}
    assert 0 < node["splitPercentage"] < 100
    yield from shown(node["first"])
    yield from shown(node["second"])


def plotted() -> list[dict[str, Any]]:
    return [path for panel in PANELS.values() for path in panel.get("paths", [])]


def test_every_panel_is_shown_once_and_there_are_those_that_matter():
    assert sorted(shown(LAYOUT["layout"])) == sorted(PANELS)
    kinds = {name.partition("!")[0] for name in PANELS}
    assert {"3D", "Plot", "DiagnosticSummary"} <= kinds


@pytest.mark.parametrize("path", plotted(), ids=lambda path: path["value"])
def test_what_is_plotted_is_a_number_that_is_published(path):
    assert resolve(path["value"]) == "double"
    assert path["enabled"]


def test_other_panels_show_topics_of_the_type_that_they_take():
    panel = PANELS["3D!robot"]
    kinds = {type_of(topic) for topic in panel["topics"]}
    assert kinds == {"std_msgs/msg/String", "geometry_msgs/msg/PoseStamped"}
    assert panel["followTf"] == "base"
    diagnostics = PANELS["DiagnosticSummary!nodes"]["topicToRender"]
    assert type_of(diagnostics) == "diagnostic_msgs/msg/DiagnosticArray"
    assert resolve(PANELS["RawMessages!stage"]["topicPath"]) == "diagnostic_msgs/DiagnosticStatus"
    assert PANELS["RosOut!log"]["topicToRender"] in OF_ROS


def test_every_joint_is_beside_what_was_shown_of_it():
    """An index names another joint on each topic: the simulator's order, and the robot's file."""
    robot = load_parameters_file(ROOT / "config" / "baxter.yaml", "controller")["joints"]
    orders = {"/joint_states": PUBLISHED_JOINTS, "/controller/reference": robot}
    found: dict[str, dict[str, str]] = {topic: {} for topic in orders}
    for path in plotted():
        topic, index = re.fullmatch(r"([\w/]+)\.\w+(?:\[(\d+)\])?", path["value"]).groups()
        if topic in orders:
            joint = orders[topic][int(index)]
            assert path["label"] == (
                f"{joint} shown" if topic == "/controller/reference" else joint
            )
            found[topic][joint] = path["color"]
    assert set(found["/joint_states"]) == set(robot)
    assert found["/joint_states"] == found["/controller/reference"]


def test_all_numbers_of_a_learners_progress_are_plotted():
    pages = {page.stem for page in (ROOT / "msgs_docs").glob("learner.progress.*.md")}
    values = {path["value"] for path in plotted()}
    assert {f"/{name.replace('.', '/')}.data" for name in pages} <= values
