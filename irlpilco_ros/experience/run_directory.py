"""The run directory: everything that one run of learning has recorded and found out.

    RUN/config.yaml         what was asked for
        demonstration/      copy of the demonstration's bag, or of several as demonstration/NNN
        trials/NNN/         bags of the trials
        iterations/KKK.npz  what iteration K found (no pickles)
        policy_KKK.yaml     its policy, a parameter file of the controller
        metrics.csv         one row for every trial that was judged
        replay/NNN/         bag of the open-loop replay, the baseline
        report/             index.html

An iteration and its policy are written before its trial, its row after it: so whatever is killed,
the files say how far the run has come, and nothing that was recorded is lost.
"""

from __future__ import annotations

import fcntl
import io
import os
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self
from zipfile import BadZipFile

import numpy as np

from irlpilco_ros.experience.configuration import (
    differing_keys,
    read_configuration,
    write_configuration,
)
from irlpilco_ros.experience.demonstrations import (
    copy_demonstrations,
    read_demonstrations,
    same_demonstrations,
)
from irlpilco_ros.experience.durable import remove_leftovers, write_atomically
from irlpilco_ros.experience.errors import RunDirectoryError
from irlpilco_ros.experience.metrics import MetricsRow, append_metrics, read_metrics
from irlpilco_ros.experience.policy_file import read_policy_file, write_policy_file
from irlpilco_ros.experience.trajectory import Trajectory
from irlpilco_ros.experience.trials import RecordedTrial, find_trials, numbered_bags
from irlpilco_ros.learning.iteration import Iteration
from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.learning.policies import Policy


class RunDirectory:
    """Names, reads and writes the files of one run.

    Anybody may read. Whoever writes has to `claim` it first: two learners on one run would mix
    their trials. It is a context manager that gives the claim back at its end.
    """

    def __init__(self, path: Path | str) -> None:
        """Name a run directory; nothing is touched."""
        self.path = Path(path).absolute()
        self._lock: int | None = None

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

    def iteration_file(self, iteration: int) -> Path:
        """What an iteration found, as npz."""
        return self.path / "iterations" / f"{iteration:03d}.npz"

    def claim(self, configuration: Mapping[str, Any], demonstration: Path) -> Self:
        """Make the run directory, or go on with it, and keep others from writing to it.

        Args:
            configuration: Everything that results depend on: name -> number, word or list.
            demonstration: Bag of the demonstration, or folder of several bags NNN.

        Returns:
            Itself, so that it can stand in a `with`.

        Raises:
            RunDirectoryError: another process has it, or it was begun with another configuration
                or demonstration; names the keys that differ.
            BagError: the demonstration cannot be read.
        """
        if not self.path.exists():
            read_demonstrations(demonstration)
        self.trials_directory.mkdir(parents=True, exist_ok=True)
        self.iteration_file(0).parent.mkdir(exist_ok=True)
        self._take_lock()
        remove_leftovers(self.path)
        remove_leftovers(self.iteration_file(0).parent)
        try:
            self._claim_configuration(configuration)
            self._claim_demonstration(demonstration)
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
        return read_demonstrations(self.demonstration_directory)

    def iterations(self) -> tuple[int, ...]:
        """Return the iterations k >= 1 whose npz and policy are on disk, in order."""
        numbers = (int(file.stem) for file in self.iteration_file(0).parent.glob("[0-9]*.npz"))
        return tuple(sorted(k for k in numbers if self.policy_file(k).exists()))

    def read_iteration(self, iteration: int) -> Iteration:
        """Return what an iteration found.

        Raises:
            RunDirectoryError: it is not there or not readable.
        """
        path = self.iteration_file(iteration)
        try:
            with np.load(path, allow_pickle=False) as arrays:
                return Iteration.from_arrays(dict(arrays))
        except (OSError, ValueError, EOFError, BadZipFile) as error:
            raise RunDirectoryError(f"cannot read iteration {iteration}: {error}") from error

    def read_policy(self, iteration: int) -> Policy:
        """Return an iteration's policy; 0 is the initial policy."""
        return read_policy_file(self.policy_file(iteration))[0]

    def metrics(self) -> tuple[MetricsRow, ...]:
        """Return the rows of the iterations, in order."""
        rows = read_metrics(self.metrics_file)
        return tuple(row for row in rows if row.iteration is not None)

    def replay_metrics(self) -> MetricsRow | None:
        """Return the row of the open-loop replay, if it was done."""
        rows = read_metrics(self.metrics_file)
        return next((row for row in rows if row.iteration is None), None)

    def trials(self, joints: Joints, horizon: int) -> dict[int, RecordedTrial]:
        """Return the whole trials by the iteration whose policy ran in them.

        A trial belongs to the iteration whose policy gives its very commands on its states
        (to 1e-9). Bags that hold no whole trial, because the robot stopped or the recorder was
        killed, and discarded ones stay where they are and are passed over.

        Args:
            joints: Joints of the run, in order.
            horizon: Control periods of a trial.
        """
        return find_trials(self.trial_bags(), self._policies(), joints, horizon)

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
        stream = io.BytesIO()
        arrays: dict[str, Any] = iteration.to_arrays()
        np.savez(stream, **arrays)
        write_atomically(self.iteration_file(iteration.index), stream.getvalue())
        self.write_policy(iteration.index, iteration.policy, joints, controller_parameters)

    def append_metrics(self, row: MetricsRow) -> None:
        """Add a row, after its trial.

        Raises:
            RunDirectoryError: not claimed, or there is a row for this iteration already.
        """
        self._check_claimed()
        append_metrics(self.metrics_file, row)

    def _policies(self) -> dict[int, Policy]:
        numbers = (int(file.stem[-3:]) for file in self.path.glob("policy_[0-9][0-9][0-9].yaml"))
        return {number: self.read_policy(number) for number in sorted(numbers)}

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

    def _claim_configuration(self, configuration: Mapping[str, Any]) -> None:
        if not self.configuration_file.exists():
            if self.trial_bags() or self.metrics_file.exists():
                raise RunDirectoryError(
                    f"{self.path} holds trials but no config.yaml; it is no run that could go "
                    "on. Choose another run directory"
                )
            write_configuration(self.configuration_file, configuration)
            return
        differences = differing_keys(self.configuration(), configuration)
        if differences:
            raise RunDirectoryError(
                f"{self.path} was begun with another configuration: {'; '.join(differences)}. "
                "Choose another run directory, or ask for the same as before"
            )

    def _claim_demonstration(self, demonstration: Path) -> None:
        copy = self.demonstration_directory
        if not copy.exists():
            copy_demonstrations(demonstration, copy)
        elif not same_demonstrations(demonstration, copy):
            raise RunDirectoryError(
                f"{self.path} was begun with another demonstration: {demonstration} differs from "
                f"the copy in {copy}. Choose another run directory, or the demonstration of "
                "before"
            )
