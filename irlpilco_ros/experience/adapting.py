"""Carry a run over to where its object is now, and as fast as is wanted: who adapts asks here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from irlpilco_ros.experience.apprenticeship import Apprenticeship
from irlpilco_ros.experience.carried_over import Moved
from irlpilco_ros.experience.demonstrations import demonstration_bags
from irlpilco_ros.experience.errors import BagError
from irlpilco_ros.experience.object_moved import check_stayed
from irlpilco_ros.experience.object_pose import ObjectSettings, demonstrated_poses, displacement
from irlpilco_ros.experience.practice import Adapted
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.kinematics.carried_path import Carrier
from irlpilco_ros.kinematics.description_file import kinematics_of
from irlpilco_ros.kinematics.tools import ToolSettings
from irlpilco_ros.learning.errors import InvalidSettingError
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

    speed: float = setting(
        1.0,
        "How many times as fast as it was shown the motion is done that is adapted: 1.25 is a "
        "quarter faster, and takes 0.8 of the time.",
        minimum=0.5,
        maximum=1.5,
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
        where: Callable[[Array], Array] | None,
        progress: Callable[[Progress], None] | None = None,
    ) -> tuple[Adapted, str]:
        """Go on where the object is now, as fast as the settings say.

        Args:
            run: What was practised so far.
            where: Returns the object's pose now (4, 4), given that in the first demonstration; None
                if it is still where the run is for.
            progress: As for `Apprenticeship.prepare`.

        Returns:
            The policy for there, and a line about it.

        Raises:
            RobotDescriptionError: where the tools are cannot be told.
            BagError: where the object was in a demonstration is not known.
            UnreachableError: the motion cannot be done there, or so fast; nothing was written.
            InvalidSettingError: what is commanded here does not scale with the speed.
        """
        speed, limit = self.settings.speed, self.settings.adapt_error_limit
        self._check_speed(speed)
        moved = self._moved(run, where)
        adapted = run.adapt(moved, speed, limit, progress)
        return adapted, (
            f"place {adapted.number}, {_whereabouts(moved)}"
            f"{'' if speed == 1.0 else f', at {speed:g} times the shown speed'}: "
            f"{adapted.forecast.sentence()}; the policy is that of iteration "
            f"{adapted.plan.iteration.index}"
        )

    def _check_speed(self, speed: float) -> None:
        robot = self.robot
        if speed != 1.0 and (robot.command_interface != "velocity" or robot.unactuated_joints):
            raise InvalidSettingError(
                f"speed is {speed:g}, but this robot is not commanded by the velocities of all its "
                "joints: what it would be commanded at another speed is not known; set speed to 1"
            )

    def _moved(self, run: Apprenticeship, where: Callable[[Array], Array] | None) -> Moved | None:
        """Return where the object is now; None for where it was shown, if no more is known."""
        now = run.object_pose
        if where is None and now is None:
            return None
        kinematics = kinematics_of(self.tools, self.robot.joints, self.description)
        carrier = Carrier(kinematics, self.robot.lower, self.robot.upper)
        bags = demonstration_bags(run.directory.demonstration_directory)
        before = demonstrated_poses(bags, self.objects.pose)
        if where is not None:
            now = where(before[0])
        assert now is not None
        return Moved(now, before, carrier)

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


def _whereabouts(moved: Moved | None) -> str:
    """Say how far the object has moved."""
    if moved is None:
        return "where it was shown"
    x, y, turn = displacement(moved.demonstrated[0], moved.object_pose)
    return f"the object moved by ({x:.3f}, {y:.3f}) m and {turn:.3f} rad"
