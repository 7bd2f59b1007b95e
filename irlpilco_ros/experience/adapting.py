"""Carry a run over to where its object is now: whoever adapts a policy asks here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from irlpilco_ros.experience.apprenticeship import Apprenticeship
from irlpilco_ros.experience.demonstrations import demonstration_bags
from irlpilco_ros.experience.errors import BagError
from irlpilco_ros.experience.object_moved import check_stayed
from irlpilco_ros.experience.object_pose import ObjectSettings, demonstrated_poses, displacement
from irlpilco_ros.experience.practice import Adapted
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.kinematics.carried_path import Carrier
from irlpilco_ros.kinematics.description_file import kinematics_of
from irlpilco_ros.kinematics.tools import ToolSettings
from irlpilco_ros.learning.iteration import Progress
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.settings import check, setting


@dataclass(frozen=True)
class AdaptSettings:
    """What a policy has to be like that was not tried yet.

    Raises:
        InvalidSettingError: a value is out of its range.
    """

    adapt_error_limit: float = setting(
        0.02,
        "Largest error, over joints and steps, that may be predicted of a policy for another place "
        "of the object, what the model does not know included; a worse one is refused.",
        unit="rad",
        minimum=0.0,
        maximum=10.0,
    )

    def __post_init__(self) -> None:
        check(self)


@dataclass(frozen=True)
class Adapter:
    """What adapting needs beside the run.

    Attributes:
        robot: Joints and limits.
        tools: The robot's tools.
        objects: Where the object was in demonstrations that do not tell.
        settings: What is accepted.
        description: The URDF that was told on robot_description, for tools that name none.
    """

    robot: RobotSettings
    tools: ToolSettings
    objects: ObjectSettings
    settings: AdaptSettings
    description: str = ""

    def adapt(
        self,
        run: Apprenticeship,
        where: Callable[[Array], Array],
        progress: Callable[[Progress], None] | None = None,
    ) -> tuple[Adapted, str]:
        """Go on where the object is now.

        Args:
            run: What was practised so far.
            where: Returns the object's pose now (4, 4), given that in the first demonstration.
            progress: As for `Apprenticeship.prepare`.

        Returns:
            The policy for there, and a line about it.

        Raises:
            RobotDescriptionError: where the tools are cannot be told.
            BagError: where the object was in a demonstration is not known.
            UnreachableError: the motion cannot be done there; nothing was written.
        """
        kinematics = kinematics_of(self.tools, self.robot.joints, self.description)
        carrier = Carrier(kinematics, self.robot.lower, self.robot.upper)
        bags = demonstration_bags(run.directory.demonstration_directory)
        before = demonstrated_poses(bags, self.objects.pose)
        now = where(before[0])
        limit = self.settings.adapt_error_limit
        adapted = run.adapt(now, before, carrier, limit, progress)
        x, y, turn = displacement(before[0], now)
        return adapted, (
            f"place {adapted.number}, the object moved by ({x:.3f}, {y:.3f}) m and {turn:.3f} rad: "
            f"{adapted.forecast.sentence()}; the policy is that of iteration "
            f"{adapted.plan.iteration.index}"
        )

    def check_stayed(self, run: Apprenticeship, readings: Array) -> None:
        """Check that the object is still where the next trial of a run is for.

        Args:
            run: What is practised, and where.
            readings: Where the object was last seen, (n, 4, 4).

        Raises:
            ObjectMovedError: it is not.
        """
        made_for = run.object_pose
        if made_for is not None:
            check_stayed([made_for], readings)
            return
        bags = demonstration_bags(run.directory.demonstration_directory)
        try:
            shown = demonstrated_poses(bags, self.objects.pose)
        except BagError:
            return  # nobody knows where it was
        check_stayed(shown, readings)
