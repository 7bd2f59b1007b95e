"""What a robot holds, and where on it: names, links and offsets, as its YAML says."""

from __future__ import annotations

from dataclasses import dataclass

from irlpilco_ros.kinematics.rigid_motion import pose
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.settings import check, setting


@dataclass(frozen=True)
class Tool:
    """A frame that is fixed to a link.

    Attributes:
        name: What the user calls it.
        link: Link of the URDF.
        offset: Its pose in the link's frame, shape (4, 4).
    """

    name: str
    link: str
    offset: Array


@dataclass(frozen=True)
class ToolSettings:
    """The robot's description, and its tools.

    Raises:
        InvalidSettingError: lists do not fit each other, or a tool is named twice.
    """

    urdf: str = setting(
        "",
        "Description of the robot: a URDF file, or package://NAME/FILE for one in the share of a "
        "package; empty for what is told on robot_description. Needed to carry a demonstration "
        "over to where its object is now.",
    )
    tools: tuple[str, ...] = setting(
        (), "Names of the tools whose poses, seen from the object, make the motion what it is."
    )
    tool_links: tuple[str, ...] = setting((), "Link of the URDF that each of `tools` is fixed to.")
    tool_xyz: tuple[float, ...] = setting(
        (),
        "Where each of `tools` is in the frame of its link: x, y, z, one after the other.",
        unit="m",
    )
    tool_rpy: tuple[float, ...] = setting(
        (),
        "How each of `tools` is turned in the frame of its link: roll, pitch, yaw as in a URDF, "
        "one after the other; empty: as its link.",
        unit="rad",
    )

    tool_size: float = setting(
        0.1,
        "With features: tools, how far from each tool, along its x and y, the second and third "
        "point are by which it is compared: more lets its turn count more beside its place; 0: "
        "only its place counts.",
        unit="m",
        minimum=0.0,
        maximum=10.0,
    )
    posture_price: float = setting(
        0.1,
        "With features: tools, what a joint that is off counts beside the tools: it keeps the "
        "joints near the demonstrated posture where the tools leave them free; 0: they may go "
        "anywhere.",
        unit="m/rad",
        minimum=0.0,
        maximum=10.0,
    )

    def __post_init__(self) -> None:
        check(self)
        if len(set(self.tools)) != len(self.tools):
            raise InvalidSettingError(f"ToolSettings.tools names a tool twice: {self.tools}")
        count = len(self.tools)
        expected = {"tool_links": (count,), "tool_xyz": (3 * count,), "tool_rpy": (0, 3 * count)}
        for name, sizes in expected.items():
            size = len(getattr(self, name))
            if size not in sizes:
                raise InvalidSettingError(
                    f"ToolSettings.{name} has {size} values; expected "
                    f"{' or '.join(map(str, dict.fromkeys(sizes)))} with {count} tools"
                )

    @property
    def each(self) -> tuple[Tool, ...]:
        """The tools."""
        angles = self.tool_rpy or (0.0,) * (3 * len(self.tools))
        offsets = [
            pose(self.tool_xyz[3 * k : 3 * k + 3], angles[3 * k : 3 * k + 3])
            for k in range(len(self.tools))
        ]
        return tuple(map(Tool, self.tools, self.tool_links, offsets))
