"""Demonstrations on disk: one bag, or a folder of bags that show one task several times."""

from __future__ import annotations

import os
import shutil
from collections.abc import Sequence
from pathlib import Path

from irlpilco_ros.experience.bag_files import bags_in, copy_bag, storage_files
from irlpilco_ros.experience.bag_reader import messages_digest, read_path
from irlpilco_ros.experience.demonstration_checks import checked_motions
from irlpilco_ros.experience.durable import sync_tree
from irlpilco_ros.experience.errors import BagError
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.experience.shown_motion import ShownMotion, Window
from irlpilco_ros.experience.trajectory import Trajectory


def demonstration_bags(path: Path) -> list[Path]:
    """Return the bags of the demonstrations; of several in the natural order of their names.

    Args:
        path: A bag (its folder or its only file), or a folder of bags; those of them that are
            marked as discarded, recovered or damaged are left out.

    Raises:
        BagError: there is neither a bag nor a folder of them.
    """
    is_folder = os.path.isdir(path)
    several = [bag for bag in bags_in(path) if os.path.isdir(bag)] if is_folder else []
    if not several:
        storage_files(path)
    return several or [path]


def read_demonstrations(
    path: Path, topic: str = "", joints: Sequence[str] = ()
) -> tuple[Trajectory, ...]:
    """Return what was shown; arguments and errors as `demonstration_bags` and `read_path`.

    Raises:
        BagError: a bag cannot be read, or holds no samples.
    """
    shown = []
    for bag in demonstration_bags(path):
        trajectory = read_path(bag, topic, joints)
        if not trajectory.stamps.size:
            raise BagError(f"the demonstration {bag} holds no samples")
        shown.append(trajectory)
    return tuple(shown)


def checked_demonstrations(
    path: Path, robot: RobotSettings, topic: str = "", window: Window = ()
) -> tuple[ShownMotion, ...]:
    """Return what bags show to a robot; whoever takes a demonstration asks here, and first.

    Args:
        path: A bag, or a folder of bags.
        robot: The robot that is to imitate it.
        topic: Which topic of joint states to take, where several tell the same joints.
        window: Begin and end of what is imitated, since the first sample [s]; empty for the motion
            that is found.

    Raises:
        UnfitDemonstrationError: they cannot be imitated; says which and all that is wrong.
        BagError: a bag cannot be read, or lacks a joint.
    """
    recorded = read_demonstrations(path, topic, robot.joints)
    try:
        return checked_motions(recorded, robot, window)
    except BagError as error:
        raise type(error)(f"the demonstration {path} is refused: {error}") from error


def copy_demonstrations(source: Path, copy: Path) -> None:
    """Copy the bags of the demonstrations to a folder that is whole as soon as it is there.

    Raises:
        BagError: they cannot be read or written.
    """
    temporary = copy.with_name(f".{copy.name}.tmp")
    shutil.rmtree(temporary, ignore_errors=True)
    bags = demonstration_bags(source)
    try:
        for bag in bags:
            copy_bag(bag, temporary if bags == [source] else temporary / bag.name)
        sync_tree(temporary)
        temporary.rename(copy)
    except OSError as error:
        raise BagError(f"cannot copy {source} to {copy}: {error.strerror or error}") from error
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def same_demonstrations(first: Path, second: Path) -> bool:
    """Whether two bags, or two folders of them, hold the same messages."""
    bags, others = demonstration_bags(first), demonstration_bags(second)
    return len(bags) == len(others) and all(
        messages_digest(bag) == messages_digest(other)
        for bag, other in zip(bags, others, strict=True)
    )
