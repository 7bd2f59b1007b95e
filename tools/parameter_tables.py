"""Writes msgs_docs/parameters.md from the settings classes, one table per node, and the names.

python tools/parameter_tables.py
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rclpy.parameter import Parameter

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from irlpilco_ros.control.controller_settings import ControllerSettings  # noqa: E402
from irlpilco_ros.experience.adapting import AdaptSettings  # noqa: E402
from irlpilco_ros.experience.object_pose import ObjectSettings  # noqa: E402
from irlpilco_ros.experience.recorder_settings import RecorderSettings  # noqa: E402
from irlpilco_ros.experience.robot_settings import RobotSettings  # noqa: E402
from irlpilco_ros.kinematics.tools import ToolSettings  # noqa: E402
from irlpilco_ros.learning.learning_settings import LearningSettings  # noqa: E402
from irlpilco_ros.learning.settings import Declaration, declarations  # noqa: E402
from irlpilco_ros.nodes.learner import RunSettings  # noqa: E402
from irlpilco_ros.ros.policy_parameters import policy_parameters  # noqa: E402
from sim_bridge.cart_pole_simulation import CartPoleSettings  # noqa: E402
from sim_bridge.demonstrator_node import DemonstratorSettings  # noqa: E402
from sim_bridge.simulation_settings import SimulationSettings  # noqa: E402

PAGE = ROOT / "msgs_docs" / "parameters.md"
NAMES = ROOT / "irlpilco_ros" / "ros" / "node_parameters.py"

SETTINGS: dict[str, tuple[type, ...]] = {
    "demonstration_recorder": (RecorderSettings, ObjectSettings),
    "controller": (RobotSettings, ControllerSettings),
    "learner": (
        RobotSettings,
        LearningSettings,
        RunSettings,
        ToolSettings,
        AdaptSettings,
        ObjectSettings,
    ),
    "baxter_simulator": (SimulationSettings,),
    "cart_pole_simulator": (CartPoleSettings,),
    "demonstrator": (DemonstratorSettings,),
}
"""What each node declares its parameters from."""

INTRODUCTION = """\
# Parameters

Every parameter of every node, written by `make docs` from the classes that declare them; on a
running node `ros2 param describe NODE NAME` says the same. The shipped files are
[config/baxter.yaml](../config/baxter.yaml) (robot),
[config/baxter_simulator.yaml](../config/baxter_simulator.yaml) (simulated robot),
[config/sweep.yaml](../config/sweep.yaml) (learner, best settings),
[config/cornered_sweep.yaml](../config/cornered_sweep.yaml) (learner, velocities held at 2 Hz) and
[config/thesis.yaml](../config/thesis.yaml) (learner, the thesis's settings).

- A file may be given to several nodes: each takes what is its own. A node that is started with a
  parameter that no node has ends with a sentence that names it and what may be meant.
- `ros2 param dump` writes all of a node, and `ros2 param load` or `--params-file` makes it again,
  bit by bit. Of one request, policy and start are taken together or not at all, the rest singly.
- An empty list, word or 0 stands for what is not set. A read-only parameter may be set to the value
  that it has.
"""

POLICY = """\
The policy is parameters of the controller too, set all at once
(see [controller/set_parameters_atomically](controller.set_parameters_atomically.md)). Which of
them there are depends on the kind.
"""


def page() -> str:
    """Return the page."""
    return "\n".join([INTRODUCTION, *(section(node) for node in SETTINGS)])


def section(node: str) -> str:
    """Return the heading and the table of one node."""
    lines = [
        f"## {node}",
        "",
        "| name | default | range | meaning |",
        "|---|---|---|---|",
        *(row(each) for cls in SETTINGS[node] for each in declarations(cls).values()),
        "",
    ]
    if node == "controller":
        lines += [POLICY, "| name | type | meaning |", "|---|---|---|", *policy_rows(), ""]
    return "\n".join(lines)


def row(declared: Declaration) -> str:
    """Return a parameter as a line of its table."""
    unit = f" [{declared.unit}]" if declared.unit else ""
    fixed = " Read-only." if declared.read_only else ""
    meaning = f"{declared.description}{unit}{fixed}"
    span = ", ".join(limits(declared))
    return f"| `{declared.name}` | {shown(declared.default)} | {span} | {meaning} |"


def policy_rows() -> Iterator[str]:
    """Yield a line for each parameter that some kind of policy has."""
    for name, descriptor in policy_parameters().items():
        kind = Parameter.Type(descriptor.type).name.lower().replace("_", " ")
        yield f"| `{name}` | {kind} | {descriptor.description} |"


def shown(value: Any) -> str:
    """Return a default value in YAML's words."""
    if isinstance(value, tuple):
        return "`[" + ", ".join(str(element) for element in value) + "]`"
    if isinstance(value, str):
        return f"`{value}`" if value else '`""`'
    return f"`{str(value).lower() if isinstance(value, bool) else value}`"


def limits(declared: Declaration) -> Iterator[str]:
    """Yield the limits of a value, or the words that are allowed."""
    yield from (f"`{choice}`" for choice in declared.choices)
    low, high = declared.minimum, declared.maximum
    if low is not None or high is not None:
        yield f"{-math.inf if low is None else low:g} to {math.inf if high is None else high:g}"


def names() -> str:
    """Return the module with the names of all settings of nodes, for those who must not import."""
    found = sorted({name for group in SETTINGS.values() for cls in group for name in own(cls)})
    lines = "".join(f'    "{name}",\n' for name in found)
    return (
        '"""Names of the parameters of all nodes, written by `make docs`."""\n\n'
        f"NODE_PARAMETERS = (\n{lines})\n"
    )


def own(cls: type) -> list[str]:
    """Return the settings of a class; those of extensions depend on what is installed."""
    return [name for name in declarations(cls) if "." not in name]


if __name__ == "__main__":
    NAMES.write_text(names(), encoding="utf-8")
    PAGE.write_text(page(), encoding="utf-8")
