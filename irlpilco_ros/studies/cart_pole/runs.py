"""The runs of the cart-pole chapter, in one process: the expert's, and those that imitate it.

Every trial is written to its own file before the next one, with what was learned for it, so that
a run that was interrupted goes on where it stood.
"""

from __future__ import annotations

import dataclasses
import hashlib
import io
import json
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from irlpilco_ros.experience.configuration import differing_keys
from irlpilco_ros.experience.durable import write_atomically
from irlpilco_ros.learning import Iteration, LearningSettings, Rollout, Task, apprenticeship, pilco
from irlpilco_ros.learning.costs import StateCost
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.features import JointPositions
from irlpilco_ros.learning.iteration import Progress
from irlpilco_ros.learning.joints import PolicyOf
from irlpilco_ros.learning.moments.gaussian import Gaussian
from irlpilco_ros.learning.policies import Policy
from irlpilco_ros.learning.settings import values_of
from sim_bridge.cart_pole_equations import CartPoleParameters, tip_distance
from sim_bridge.cart_pole_simulation import (
    CART_POLE_JOINTS,
    FORCE_LIMIT,
    CartPoleSettings,
    CartPoleSimulation,
)
from sim_bridge.episode import run_trial

Array = NDArray[np.float64]
Tell = Callable[[str, float], None]

CONTROL_PERIOD = 0.1  # [s]
HORIZON = 25  # decisions in a trial: 2.5 s
HELD_WITHIN = 0.15  # [m] of the tip from the point above the track's origin
HELD_STEPS = 10  # the last second
COST_WIDTH = 0.25  # [m] of the saturating cost, as in PILCO's example
START_SPREAD = CartPoleSettings().start_spread

EXPERT_SETTINGS = LearningSettings(
    prior_mean="zero",
    hyperprior="pilco",
    policy="rbf",
    options={"rbf.count": 25},
    initial_policy="random_controls",
    optimiser="bfgs",
    evaluations=120,
)
"""Classical PILCO as in its example, with more bumps: see docs/cart_pole.md."""


@dataclass(frozen=True)
class TrialRecord:
    """One trial and what was learned for it.

    Attributes:
        rollout: What happened, as measured.
        seconds: Computing that its policy took, by the clock [s]; 0 for the first trial.
        cpu_seconds: The same in processor time, of all threads [s]; a busy machine changes it less.
        learned: What was learned for it; empty for the first trial.
    """

    rollout: Rollout
    seconds: float
    cpu_seconds: float
    learned: dict[str, Any]

    @property
    def tip_distances(self) -> Array:
        """Distance of the tip from its goal at every tick, shape (H + 1,) [m]."""
        return tip_distance(self.rollout.states, CartPoleParameters())

    @property
    def worst_of_last_second(self) -> float:
        """Largest distance of the tip from its goal during the last second [m]."""
        return float(self.tip_distances[-HELD_STEPS - 1 :].max())

    @property
    def held(self) -> bool:
        """Whether the pole was held upright over the track's origin for the last second."""
        return self.worst_of_last_second < HELD_WITHIN

    @property
    def prediction(self) -> tuple[Array, Array] | None:
        """Predicted means (H + 1, 4) and covariances (H + 1, 4, 4); None for the first trial."""
        if not self.learned:
            return None
        return self.learned["predicted_means"], self.learned["predicted_covariances"]

    def write(self, path: Path) -> None:
        """Write the record to an npz file."""
        stream = io.BytesIO()
        own = {"states": self.rollout.states, "controls": self.rollout.controls}
        learned = {f"learned_{name}": value for name, value in self.learned.items()}
        times = {"seconds": self.seconds, "cpu_seconds": self.cpu_seconds}
        arrays: dict[str, Any] = {**times, **own, **learned}
        np.savez(stream, **arrays)
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, stream.getvalue())

    @staticmethod
    def read(path: Path) -> TrialRecord:
        """Return the record in a file."""
        with np.load(path, allow_pickle=False) as arrays:
            learned = {
                name.removeprefix("learned_"): arrays[name]
                for name in arrays
                if name.startswith("learned_")
            }
            rollout = Rollout(arrays["states"], arrays["controls"])
            times = float(arrays["seconds"]), float(arrays["cpu_seconds"])
            return TrialRecord(rollout, *times, learned)


def claim(out: Path, demonstration: Rollout, settings: LearningSettings) -> None:
    """Write down what the runs in a folder are made with, before the first of them.

    Args:
        out: The folder.
        demonstration: What is imitated.
        settings: How; the method is left out, for there is a folder for each.

    Raises:
        InvalidSettingError: if the folder has runs that were made with something else.
    """
    own: dict[str, Any] = {
        "demonstration": hashlib.sha256(demonstration.states.tobytes()).hexdigest()[:16],
        "imitation": values_of(settings),
        "expert": values_of(EXPERT_SETTINGS),
    }
    del own["imitation"]["imitation"]
    own = json.loads(json.dumps(own))
    file = out / "settings.json"
    if not file.exists():
        out.mkdir(parents=True, exist_ok=True)
        write_atomically(file, json.dumps(own, indent=1).encode())
        return
    found = json.loads(file.read_text())
    differ = [name for name in own if _differs(found.get(name), own[name])]
    if differ:
        raise InvalidSettingError(
            f"{out} has runs made with other settings ({', '.join(differ)}; see {file}); "
            "choose another folder with --out, or remove this one"
        )


def _differs(before: Any, now: Any) -> bool:
    settings = isinstance(before, dict) and isinstance(now, dict)
    return bool(differing_keys(before, now)) if settings else bool(before != now)


def expert_task() -> Task:
    """Return PILCO's example: swing up from N(0, 0.1^2 I), saturating cost of the tip."""
    length = CartPoleParameters().length
    # From the features (x, sin, cos) to the tip's place relative to its goal.
    to_tip = np.array([[1.0, length, 0.0], [0.0, 0.0, length]])
    features = JointPositions.of_robot(CART_POLE_JOINTS)
    goal = np.array([0.0, 0.0, -1.0])
    return Task(
        (),
        CONTROL_PERIOD,
        np.array([FORCE_LIMIT]),
        layout=CART_POLE_JOINTS.layout,
        cost=StateCost(features, goal, to_tip.T @ to_tip / COST_WIDTH**2),
        start=Gaussian(np.zeros(4), START_SPREAD**2 * np.eye(4)),
        horizon=HORIZON,
    )


def imitation_task(demonstration: Rollout) -> Task:
    """Return the problem of imitating a demonstration's states; its controls are not looked at."""
    unknown = Rollout(demonstration.states, np.full_like(demonstration.controls, np.nan))
    noise = CartPoleSettings()
    return Task(
        (unknown,),
        CONTROL_PERIOD,
        np.array([FORCE_LIMIT]),
        JointPositions.of_robot(CART_POLE_JOINTS),
        position_noise=noise.position_noise,
        velocity_noise=noise.velocity_noise,
        layout=CART_POLE_JOINTS.layout,
        start_spread=START_SPREAD,
    )


def run_expert(folder: Path, seed: int, trials: int, tell: Tell) -> list[TrialRecord]:
    """Learn a swing-up by classical PILCO until a trial holds the pole.

    Args:
        folder: Where the trials are written, and found again.
        seed: Of starts, noise, first controls and first policy.
        trials: Largest number of trials.
        tell: Told which trial is under way and how much of it is done.
    """

    def finished(records: list[TrialRecord]) -> bool:
        return bool(records) and (records[-1].held or len(records) >= trials)

    settings = dataclasses.replace(EXPERT_SETTINGS, seed=seed)
    return _run(pilco, expert_task(), settings, folder, finished, tell)


def run_imitation(
    folder: Path,
    demonstration: Rollout,
    settings: LearningSettings,
    seed: int,
    iterations: int,
    tell: Tell,
) -> list[TrialRecord]:
    """Learn by IRL/PILCO from a demonstration; arguments as `run_expert`.

    Args:
        folder: Where the trials are written, and found again.
        demonstration: What to imitate; only its states count.
        settings: How.
        seed: Of starts, noise and the first trial.
        iterations: How often to learn; there is one trial more.
        tell: Told which iteration is under way and how much of it is done.
    """

    def finished(records: list[TrialRecord]) -> bool:
        return len(records) > iterations

    settings = dataclasses.replace(settings, seed=seed)
    return _run(apprenticeship, imitation_task(demonstration), settings, folder, finished, tell)


def _run(
    algorithm: Callable[..., Iterator[Iteration]],
    task: Task,
    settings: LearningSettings,
    folder: Path,
    finished: Callable[[list[TrialRecord]], bool],
    tell: Tell,
) -> list[TrialRecord]:
    """Return the trials in a folder, after going on with them until they are finished."""
    robot = _Robot(settings.seed)
    records = list(_stored(folder, robot))
    if finished(records):
        return records
    trials = [record.rollout for record in records]
    last = Iteration.from_arrays(records[-1].learned) if len(records) > 1 else None

    def progress(now: Progress) -> None:
        tell(f"iteration {len(records)}", now.fraction)

    for iteration in algorithm(task, settings, robot.run, trials, last, progress):
        learned = iteration.to_arrays() if iteration.index else {}
        times = robot.waited if iteration.index else (0.0, 0.0)
        records.append(TrialRecord(iteration.trial, *times, learned))
        records[-1].write(_file(folder, iteration.index))
        if finished(records):
            break
    return records


class _Robot:
    """The simulated cart-pole, reset before every trial.

    Attributes:
        waited: How long it waited for its last policy, by the clock and of the processors [s].
    """

    def __init__(self, seed: int) -> None:
        self._simulation = CartPoleSimulation(CartPoleSettings(seed=seed))
        self._idle_since = time.perf_counter(), time.process_time()
        self.waited = 0.0, 0.0

    def run(self, policy: Policy) -> Rollout:
        began = self._idle_since
        self.waited = time.perf_counter() - began[0], time.process_time() - began[1]
        rollout = run_trial(
            self._simulation, PolicyOf(CART_POLE_JOINTS, policy), HORIZON, CONTROL_PERIOD
        )
        self._simulation.reset()
        self._idle_since = time.perf_counter(), time.process_time()
        return rollout

    def skip(self) -> None:
        """Take the start of a trial that was done before."""
        self._simulation.reset()


def _stored(folder: Path, robot: _Robot) -> Iterator[TrialRecord]:
    number = 0
    while (path := _file(folder, number)).exists():
        robot.skip()
        yield TrialRecord.read(path)
        number += 1


def _file(folder: Path, number: int) -> Path:
    return folder / f"trial_{number:03d}.npz"
