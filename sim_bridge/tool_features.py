"""The features `tools`: where the simulated Baxter's tools are, instead of how its joints stand."""

from __future__ import annotations

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.features import CubatureFeatures
from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.learning.registry import NoSettings
from sim_bridge.joints import ARM_JOINTS
from sim_bridge.tool_kinematics import ToolKinematics


class ToolPoints(CubatureFeatures):
    """x, y, z of the dustpan's lip and of the brush's tip [m], six features."""

    @classmethod
    def of_robot(cls, joints: Joints, settings: NoSettings) -> ToolPoints:
        """Return the tool points of Baxter's two arms.

        Raises:
            InvalidSettingError: these are not Baxter's joints, in the order of config/baxter.yaml.
        """
        if joints.names != ARM_JOINTS:
            raise InvalidSettingError(
                f"the features 'tools' are those of the simulated Baxter with the joints "
                f"{', '.join(ARM_JOINTS)}; this robot has {', '.join(joints.names)}. Choose "
                "features: joints"
            )
        kinematics = ToolKinematics()
        return cls(len(ARM_JOINTS), kinematics, ("m",) * kinematics.size)
