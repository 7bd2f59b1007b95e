"""The run directory: everything that one run of learning has recorded and found out.

    RUN/config.yaml         what was asked for
        demonstration/      copy of the demonstration's bag, or of several as demonstration/NNN;
                            demonstration.replaced is one that nothing was learned from
        trials/NNN/         bags of the trials
        iterations/KKK.npz  what iteration K found (no pickles)
        places/NNN.npz      where else the object was, and what is imitated there
        rollouts/NNN.npz    what is learned from a trial, so that its bag need not be read again
        policy_KKK.yaml     its policy, a parameter file of the controller
        best_policy.yaml    a copy of the policy whose trial was the best so far
        metrics.csv         one row for every trial that was judged
        replay/NNN/         bag of the open-loop replay, the baseline
        report/             index.html

An iteration and its policy are written before its trial, its row after it: so whatever is killed,
the files say how far the run has come, and nothing that was recorded is lost.
"""

from __future__ import annotations

import fcntl
import functools
import math
import os
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from irlpilco_ros.experience.bag_files import DAMAGED, first_free, mark, numbered_bags, suffixed
from irlpilco_ros.experience.bag_reader import read_path
from irlpilco_ros.experience.configuration import (
    differing_keys,
    read_configuration,
    write_configuration,
)
from irlpilco_ros.experience.demonstrations import (
    copy_demonstrations,
    demonstration_bags,
    read_demonstrations,
    same_demonstrations,
)
from irlpilco_ros.experience.durable import remove_leftovers
from irlpilco_ros.experience.errors import BagError, RunDirectoryError
from irlpilco_ros.experience.iteration_file import read_iteration_file, write_iteration_file
from irlpilco_ros.experience.metrics import (
    MetricsRow,
    append_metrics,
    read_metrics,
    withdraw_metrics,
)
from irlpilco_ros.experience.places import Place, place_file, read_places, write_place
from irlpilco_ros.experience.policy_file import read_policy_file, write_policy_file
from irlpilco_ros.experience.private_folder import make_private
from irlpilco_ros.experience.trajectory import Trajectory
from irlpilco_ros.experience.trial_cache import kept_trial
from irlpilco_ros.experience.trials import TrialSearch, find_trials, merged
from irlpilco_ros.learning.iteration import Iteration
from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.policies import Policy
from irlpilco_ros.learning.rollout import Rollout

REPLACED = ".replaced"
"""What the name of a demonstration ends with that another one took the place of."""

WINDOW = "demonstration_window"
"""Key of the part of the demonstration that is imitated, if one was named."""


class RunDirectory:
    """Names, reads and writes the files of one run.

    Anybody may read. Whoever writes has to `claim` it first: two learners on one run would mix
    their trials. It is a context manager that gives the claim back at its end.
    """

    def __init__(self, path: Path | str) -> None:
        """Name a run directory; nothing is touched."""
        self.path = Path(path).absolute()
        self._lock: int | None = None
        self._reading: tuple[str, tuple[str, ...]] | None = None

    @property
    def configuration_file(self) -> Path:
        """What the run was begun with."""
        return self.path / "config.yaml"

    @property
    def demonstration_directory(self) -> Path:
        """Copy of the demonstration's bag, or of several bags NNN."""
        return self.path / "demonstration"

    @property
    def trials_directory(self) -> Path:
        """Where the recorder puts the trials' bags."""
        return self.path / "trials"

    @property
    def places_directory(self) -> Path:
        """Where else the object was, one file each."""
        return self.path / "places"

    @property
    def rollouts_directory(self) -> Path:
        """Where is kept what is learned from the trials; made anew from their bags."""
        return self.path / "rollouts"

    @property
    def replay_directory(self) -> Path:
        """Where the recorder puts the bag of the open-loop replay."""
        return self.path / "replay"

    @property
    def report_directory(self) -> Path:
        """Where the report is."""
        return self.path / "report"

    @property
    def metrics_file(self) -> Path:
        """The table of all trials."""
        return self.path / "metrics.csv"

    def policy_file(self, iteration: int) -> Path:
        """Parameter file of an iteration's policy; 0 is the initial policy."""
        return self.path / f"policy_{iteration:03d}.yaml"

    @property
    def best_policy_file(self) -> Path:
        """Copy of the policy whose trial was the best so far."""
        return self.path / "best_policy.yaml"

    def iteration_file(self, iteration: int) -> Path:
        """What an iteration found, as npz."""
        return self.path / "iterations" / f"{iteration:03d}.npz"

    def claim(
        self, configuration: Mapping[str, Any], demonstration: Path, replace: bool = False
    ) -> Self:
        """Make the run directory, or go on with it, and keep others from writing to it.

        Args:
            configuration: Everything that results depend on: name -> number, word or list.
            demonstration: Bag of the demonstration, or folder of several bags NNN.
            replace: Whether it, or another part of it, takes the place of one that nothing was
                learned from; that one is kept.

        Returns:
            Itself, so that it can stand in a `with`.

        Raises:
            RunDirectoryError: another process has it, or it was begun with another configuration
                or demonstration; names the keys that differ.
            BagError: the demonstration cannot be read.
        """
        if not os.path.exists(self.path):
            read_demonstrations(demonstration, *_reading(configuration))
        try:
            make_private(self.trials_directory)
            self.iteration_file(0).parent.mkdir(exist_ok=True)
            self.rollouts_directory.mkdir(exist_ok=True)
            self._take_lock()
            remove_leftovers(self.path)
            remove_leftovers(self.iteration_file(0).parent)
            remove_leftovers(self.rollouts_directory)
        except OSError as error:
            self.release()
            raise RunDirectoryError(
                f"cannot write to the run directory {self.path}: {error.strerror or error}"
            ) from error
        try:
            replace = replace and not self.has_learned()
            self._claim_configuration(configuration, replace)
            self._claim_demonstration(demonstration, replace)
        except BaseException:
            self.release()
            raise
        return self

    def release(self) -> None:
        """Let others write; the kernel does so too when the process dies."""
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.release()

    def configuration(self) -> dict[str, Any]:
        """Return what the run was begun with.

        Raises:
            RunDirectoryError: this is no run directory.
        """
        return read_configuration(self.configuration_file)

    def demonstrations(self) -> tuple[Trajectory, ...]:
        """Return what was shown, once or several times."""
        return read_demonstrations(self.demonstration_directory, *self._how_to_read())

    def iterations(self) -> tuple[int, ...]:
        """Return the iterations k >= 1 whose npz and policy are on disk, in order."""
        numbers = _numbers(self.iteration_file(0).parent, r"(\d{3,})\.npz")
        return tuple(k for k in numbers if os.path.lexists(self.policy_file(k)))

    def has_learned(self) -> bool:
        """Whether a trial was recorded, or the motion was carried over to another place.

        From then on the demonstration stays what it is.
        """
        begun = (self.metrics_file, self.places_directory)
        return bool(self.trial_bags()) or any(map(os.path.lexists, begun))

    @property
    def moved_at(self) -> float:
        """The first iteration that was for another place of the object; infinite if none was."""
        firsts = [place.first for place in read_places(self.places_directory) if place.shown]
        return min(firsts, default=math.inf)

    def read_iteration(self, iteration: int) -> Iteration:
        """Return what an iteration found.

        Raises:
            RunDirectoryError: it is not there or not readable, or it is another iteration.
        """
        found = read_iteration_file(self.iteration_file(iteration))
        if found.index != iteration:
            raise RunDirectoryError(
                f"{self.iteration_file(iteration)} holds iteration {found.index}; files of "
                "iterations are named by their number"
            )
        return found

    def read_policy(self, iteration: int) -> Policy:
        """Return an iteration's policy; 0 is the initial policy."""
        return read_policy_file(self.policy_file(iteration))[0]

    def metrics(self) -> tuple[MetricsRow, ...]:
        """Return the rows of the iterations, in order."""
        rows = read_metrics(self.metrics_file)
        return tuple(row for row in rows if row.iteration is not None)

    def baseline_metrics(self, baseline: str) -> MetricsRow | None:
        """Return the row of the replay or the demonstration, if there is one.

        Args:
            baseline: REPLAY or DEMONSTRATION.
        """
        rows = read_metrics(self.metrics_file)
        return next((row for row in rows if row.name == baseline), None)

    def read_trial(
        self,
        bag: Path,
        joints: Joints,
        horizon: int,
        period: float | None = None,
    ) -> Rollout:
        """Return what is learned from the whole trial in a bag; arguments as `Trajectory.trial`.

        A trial of the run is read once: as long as its bag is the same, byte by byte, what was
        learned from it is taken from `rollouts`.

        Raises:
            UnreadableBagError: the bag is not there, is empty or damaged.
            IncompleteTrialError: it holds no whole trial.
            BagError: it lacks a joint, or is none of this robot's.
        """

        def read() -> Rollout:
            return self.read_path(bag).trial(joints, horizon, period, smooth=True)

        if bag.parent != self.trials_directory:
            return read()
        how = repr((self._how_to_read(), joints, horizon, period))
        kept = self.rollouts_directory / f"{bag.name}.npz"
        return kept_trial(kept, bag, how, read, keep=self._lock is not None)

    def read_path(self, bag: Path) -> Trajectory:
        """Return all that a bag of the run tells of the motion; errors as `read_bag`."""
        return read_path(bag, *self._how_to_read())

    def demonstration_paths(self) -> tuple[Trajectory, ...]:
        """Return all that the demonstrations tell of the motion; errors as `read_bag`."""
        return tuple(map(self.read_path, demonstration_bags(self.demonstration_directory)))

    def search_trials(
        self,
        joints: Joints,
        horizon: Callable[[int], int],
        since: int = 0,
        period: float | None = None,
        reach: Array | None = None,
    ) -> TrialSearch:
        """Return the whole trials by the iteration whose policy ran in them.

        A trial belongs to the iteration whose policy gives its commands on its states (see
        `find_trials`). Bags that hold no whole trial, because the robot stopped or the recorder was
        killed, stay where they are; discarded ones are passed over.

        Args:
            joints: Joints of the run, in order.
            horizon: Returns the control periods of an iteration's trial.
            since: First iteration to look for; the bags of judged ones before it are not read.
            period: Control period that trials must have [s]; None for any.
            reach: By how much commands may change in it (F,) [rad/s]; None for any.
        """
        judged = {row.trial for row in self.metrics() if (row.iteration or 0) < since}
        bags = [(number, bag) for number, bag in self.trial_bags() if number not in judged]
        policies = self._policies(since) if bags else {}

        def read(bag: Path, steps: int) -> tuple[Rollout, Rollout]:
            path = self.read_path(bag)
            seen = path.trial(joints, steps, period)
            return seen, path.trial(joints, steps, period, smooth=True)

        lengths = dict.fromkeys([horizon(since), *map(horizon, policies)])
        searches = [
            find_trials(
                bags,
                {k: policy for k, policy in policies.items() if horizon(k) == steps},
                joints,
                functools.partial(read, steps=steps),
                reach,
            )
            for steps in lengths
        ]
        return merged(searches)

    def set_aside(self, bag: Path) -> Path:
        """Rename a trial's bag that cannot be read: nobody learns from it, and its data stay.

        Raises:
            RunDirectoryError: not claimed.
            BagError: it cannot be renamed.
        """
        self._check_claimed()
        suffix = first_free(suffixed(bag, DAMAGED)).name.removeprefix(bag.name)
        return mark(bag, suffix)

    def withdraw(self, iteration: int) -> Path:
        """Take back the rows of an iteration and of those after it, for its trial is lost.

        Policies and trials stay, and are judged anew once the lost trial has been done again.

        Returns:
            Where metrics.csv as it was is kept.

        Raises:
            RunDirectoryError: not claimed.
        """
        self._check_claimed()
        return withdraw_metrics(self.metrics_file, iteration)

    def trial_bags(self) -> list[tuple[int, Path]]:
        """Return number and path of every trial's bag that was not discarded, whole or not."""
        return numbered_bags(self.trials_directory)

    def write_policy(
        self,
        iteration: int,
        policy: Policy,
        joints: Joints,
        controller_parameters: Mapping[str, Any] | None = None,
    ) -> Path:
        """Write the policy of an iteration, before its trial; 0 is the initial policy.

        Args:
            iteration: k.
            policy: Its policy.
            joints: Joints of the run, in order.
            controller_parameters: What else the controller needs to run it without a learner.

        Raises:
            RunDirectoryError: not claimed, or the iteration's trial is judged already.
        """
        self._check_open(iteration)
        path = self.policy_file(iteration)
        write_policy_file(path, policy, joints, controller_parameters)
        return path

    def write_iteration(
        self,
        iteration: Iteration,
        joints: Joints,
        controller_parameters: Mapping[str, Any] | None = None,
    ) -> None:
        """Write what an iteration found, then its policy; arguments and errors as write_policy."""
        self._check_open(iteration.index)
        write_iteration_file(self.iteration_file(iteration.index), iteration)
        self.write_policy(iteration.index, iteration.policy, joints, controller_parameters)

    def begin_place(self, place: Place) -> None:
        """Write a place, and drop what was computed for the trial that comes next elsewhere.

        Raises:
            RunDirectoryError: not claimed.
            FileError: it cannot be written.
        """
        self._check_open(place.first)
        for computed in (self.iteration_file(place.first), self.policy_file(place.first)):
            computed.unlink(missing_ok=True)
        number = len(read_places(self.places_directory)) + 1
        write_place(place_file(self.places_directory, number), place)

    def append_metrics(self, row: MetricsRow) -> None:
        """Add a row, after its trial.

        Raises:
            RunDirectoryError: not claimed, or there is a row for this iteration already.
        """
        self._check_claimed()
        append_metrics(self.metrics_file, row)

    def _how_to_read(self) -> tuple[str, tuple[str, ...]]:
        """Return which topic and joints the run reads; they never change."""
        if self._reading is None:
            self._reading = _reading(self.configuration())
        return self._reading

    def _policies(self, since: int) -> dict[int, Policy]:
        numbers = _numbers(self.path, r"policy_(\d{3,})\.yaml")
        return {number: self.read_policy(number) for number in numbers if number >= since}

    def _check_claimed(self) -> None:
        if self._lock is None:
            raise RunDirectoryError(f"{self.path} is open for reading only; claim it first")

    def _check_open(self, iteration: int) -> None:
        self._check_claimed()
        if any(row.iteration == iteration for row in self.metrics()):
            raise RunDirectoryError(
                f"iteration {iteration} of {self.path} is over: its trial is judged in "
                "metrics.csv, and nothing recorded is replaced"
            )

    def _take_lock(self) -> None:
        self.release()
        path = self.path / ".lock"
        lock = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            holder = os.read(lock, 100).decode(errors="replace").strip() or "unknown"
            os.close(lock)
            raise RunDirectoryError(
                f"{self.path} is in use by another learner (process {holder}); stop it, or "
                "choose another run directory"
            ) from None
        os.ftruncate(lock, 0)
        os.write(lock, f"{os.getpid()}\n".encode())
        self._lock = lock

    def check_configuration(self, configuration: Mapping[str, Any], replace: bool = False) -> None:
        """Check that a run was begun with this configuration, if it was begun at all.

        Args:
            configuration: As in `claim`.
            replace: Whether another part of the demonstration may be named.

        Raises:
            RunDirectoryError: names the keys that differ.
        """
        if not os.path.lexists(self.configuration_file):
            return
        before = self.configuration()
        if replace and not self.has_learned():
            before.pop(WINDOW, None)
            before |= {WINDOW: configuration[WINDOW]} if WINDOW in configuration else {}
        differences = differing_keys(before, configuration)
        if differences:
            raise RunDirectoryError(
                f"{self.path} was begun with another configuration: {'; '.join(differences)}. "
                "Choose another run directory, or ask for the same as before"
            )

    def check_demonstration(self, demonstration: Path, replace: bool = False) -> None:
        """Check that a demonstration is the run's own, or may `replace` one without a trial.

        Raises:
            RunDirectoryError: the run was begun with another one.
        """
        copy = self.demonstration_directory
        replace = replace and not self.has_learned()
        if copy.exists() and not replace and not self._is_own(demonstration):
            raise RunDirectoryError(
                f"{self.path} was begun with another demonstration: {demonstration} differs from "
                f"the copy in {copy}. Choose another run directory, or the demonstration of before"
            )

    def _claim_configuration(self, configuration: Mapping[str, Any], replace: bool) -> None:
        begun = os.path.lexists(self.configuration_file)
        if not begun and self.has_learned():
            raise RunDirectoryError(
                f"{self.path} holds trials but no config.yaml; it is no run that could go on. "
                "Choose another run directory"
            )
        self.check_configuration(configuration, replace)
        if replace or not begun:
            write_configuration(self.configuration_file, configuration)

    def _is_own(self, demonstration: Path) -> bool:
        copy = self.demonstration_directory
        return demonstration.absolute() == copy or same_demonstrations(demonstration, copy)

    def _claim_demonstration(self, demonstration: Path, replace: bool) -> None:
        copy = self.demonstration_directory
        if copy.exists() and self._is_own(demonstration):
            return
        self.check_demonstration(demonstration, replace)
        replaced = first_free(suffixed(copy, REPLACED)) if copy.exists() else None
        if replaced is not None:
            copy.rename(replaced)
        try:
            copy_demonstrations(demonstration, copy)
        except BagError:
            if replaced is not None:
                replaced.rename(copy)
            raise


def _reading(configuration: Mapping[str, Any]) -> tuple[str, tuple[str, ...]]:
    """Return which topic of joint states a run reads, and which joints make its samples."""
    topic, joints = configuration.get("joint_states_topic", ""), configuration.get("joints", ())
    names = joints if isinstance(joints, list | tuple) else ()
    return str(topic), tuple(str(name) for name in names)


def _numbers(folder: Path, pattern: str) -> list[int]:
    """Return the numbers in the names of the files that match a pattern, in order."""
    names = os.listdir(folder) if os.path.isdir(folder) else []
    matches = (re.fullmatch(pattern, name) for name in names)
    return sorted(int(match.group(1)) for match in matches if match)
