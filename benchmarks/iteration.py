"""One iteration of learning the sweep as a hand shows it, after five trials, at 4 and at 10 Hz.

The trials before are those of iterative learning control, which computes nothing. Only learning is
timed; what the policy is worth is its path error in the trial that follows.
"""

from __future__ import annotations

import dataclasses
import math
import time
from dataclasses import dataclass

from benchmarks.timing import conditions
from irlpilco_ros.learning import Rollout
from irlpilco_ros.learning.joints import PolicyOf
from irlpilco_ros.learning.learn import learn
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.studies.baxter.iterative_control import improved
from irlpilco_ros.studies.baxter.motion_bench import MotionBench, sweep_settings
from irlpilco_ros.studies.baxter.motion_measure import BAXTER_JOINTS

TRIALS = 5
_GAIN = 0.5


@dataclass(frozen=True)
class Case:
    """What is measured.

    Attributes:
        period: Control period [s].
        model_points: Largest number of points that the dynamics model consists of.
        bar: Computing that an iteration may take on two cores [s].
    """

    period: float
    model_points: int
    bar: float


CASES = (Case(0.25, 300, 4.0), Case(0.1, 300, math.inf), Case(0.1, 200, 8.0))


@dataclass(frozen=True)
class _Held:
    """Speeds (H, F), each held for a period."""

    speeds: Array

    def act(self, _state: Array, step: int) -> Array:
        return self.speeds[step]


def main() -> None:
    """Print the computing time of each iteration, and how far off the trial after it is."""
    print(conditions())
    print(
        "rate     points  of the model  computing   (bar)  processors  error of the path after it"
    )
    for case in CASES:
        bench = MotionBench("default", 0, case.period)
        trials = _trials(bench)
        settings = dataclasses.replace(sweep_settings(), model_points=case.model_points)
        before = learn(bench.task, settings, trials[:-1])
        began, worked = time.perf_counter(), time.process_time()
        found = learn(bench.task, settings, trials, before)
        seconds, worked = time.perf_counter() - began, time.process_time() - worked
        after = bench.measured(bench.run(PolicyOf(BAXTER_JOINTS, found.policy)))
        points = TRIALS * bench.task.horizon
        print(
            f"{1.0 / case.period:4.0f} Hz {points:8d} {min(points, case.model_points):13d} "
            f"{seconds:8.1f} s {case.bar:7.0f} {worked:9.1f} s {1e3 * after['path']:10.2f} mrad",
            flush=True,
        )


def _trials(bench: MotionBench) -> list[Rollout]:
    """Return five trials of iterative learning control."""
    speeds, trials = bench.task.demonstrated_controls(), []
    for _ in range(TRIALS):
        recording = bench.run(_Held(speeds))
        trials.append(bench.rollout(recording, bench.task.dt))
        speeds = improved(bench, speeds, recording, _GAIN)
    return trials


if __name__ == "__main__":
    main()
