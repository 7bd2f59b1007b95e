"""What a demonstration is compared by: features of the state."""

from irlpilco_ros.learning.features.base import REGISTRY, Features
from irlpilco_ros.learning.features.cubature import CubatureFeatures
from irlpilco_ros.learning.features.joint_motion import JointMotion
from irlpilco_ros.learning.features.joint_positions import JointPositions
from irlpilco_ros.learning.features.positions_and_angles import PositionsAndAngles
from irlpilco_ros.learning.features.tool_points import ComparedTools, ToolPoints

__all__ = [
    "REGISTRY",
    "ComparedTools",
    "CubatureFeatures",
    "Features",
    "JointMotion",
    "JointPositions",
    "PositionsAndAngles",
    "ToolPoints",
]
