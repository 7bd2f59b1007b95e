"""Recorded motions once more in simulation, with debris on the table, for pictures and counts.

A motion is played back by guiding the simulated arms along all joint states that were recorded, so
that what is seen and counted is the motion in the bag and not a new attempt of the policy. The
functions run in processes of their own (`workers`).
"""

from __future__ import annotations

import os
import signal
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.context import SpawnContext, SpawnProcess
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sim_bridge.guided_motion import Guidable, GuidedMotion
from sim_bridge.joints import ARM_JOINTS

if TYPE_CHECKING:
    from sim_bridge.baxter_simulation import BaxterSimulation

PIECES = 20
"""Pieces of debris on the table."""
SETTLING_TIME = 0.5
"""How long the arms stand at the end before the debris is counted [s]."""
CAMERA = "front"
FRAME_SIZE = (480, 320)
"""Width and height of a picture [pixel]."""
FRAME_STEP = 16
"""Steps of 10 ms from picture to picture: the animation has 6.25 a second."""
SHADOW_SIZE = 2048
"""Resolution of shadows [pixel]: without a graphics card, pictures are most of the time spent."""


@dataclass(frozen=True)
class Film:
    """Pictures of a motion, one every `FRAME_STEP`.

    Attributes:
        frames: shape (n, height, width, 3); the first at the start of the motion.
        times: of each picture, shape (n,) [s].
    """

    frames: NDArray[np.uint8]
    times: NDArray[np.float64]


def can_resimulate(joints: Iterable[str]) -> bool:
    """Whether these are joints of the simulated robot."""
    return set(joints) <= set(ARM_JOINTS)


def can_sweep(joints: Iterable[str]) -> bool:
    """Whether joints of both arms are among these: one holds the brush, the other the pan."""
    return {"left", "right"} <= {joint.partition("_")[0] for joint in joints}


@contextmanager
def workers() -> Iterator[ProcessPoolExecutor]:
    """Give a pool of at most two fresh processes: OpenGL and MuJoCo stay out of this one.

    At the end of the `with`, what has not begun is dropped.
    """
    count = min(2, os.cpu_count() or 1)
    pool = ProcessPoolExecutor(count, _Workers())
    try:
        yield pool
    finally:
        pool.shutdown(cancel_futures=True)


class _Worker(SpawnProcess):
    """A process to which Ctrl-C is nothing, also while it imports: the parent ends it."""

    def start(self) -> None:
        """Start it; a mask of signals is inherited, a handler is not."""
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            super().start()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


class _Workers(SpawnContext):
    Process = _Worker


def count_debris(motion: Guidable, seed: int, place: Sequence[float] = (0.0, 0.0, 0.0)) -> int:
    """Return how many of `PIECES`, scattered by a seed, are in the pan after a motion.

    Args:
        motion: The motion.
        seed: Of the scatter.
        place: Where the pile lies, relative to where it was shown: x, y [m], turn [rad].
    """
    # Imported here: the page is built without MuJoCo, too.
    from sim_bridge.episode import guide_through

    simulation = _at_start(motion, seed, place)
    guide_through(simulation, motion)
    end, _ = motion.at(motion.duration)
    guide_through(simulation, GuidedMotion(motion.joints, SETTLING_TIME, np.stack([end, end])))
    return simulation.debris_in_pan()


def film(motion: Guidable, seed: int, place: Sequence[float] = (0.0, 0.0, 0.0)) -> Film:
    """Return pictures of a motion through debris; arguments as `count_debris`.

    Raises:
        RenderingError: nothing here draws without a screen; says what to install.
    """
    from sim_bridge.episode import guide_through
    from sim_bridge.rendering import FrameRenderer

    simulation = _at_start(motion, seed, place)
    _simplify(simulation.model)
    frames, times = [], []
    with FrameRenderer(simulation, *FRAME_SIZE, camera=CAMERA) as renderer:

        def draw() -> None:
            if round(simulation.time * 100) % FRAME_STEP == 0:
                frames.append(renderer.frame())
                times.append(simulation.time)

        draw()
        guide_through(simulation, motion, each_state=draw)
    return Film(np.stack(frames), np.array(times))


def _simplify(model: Any) -> None:
    """Draw at half the cost: coarser cylinders and shadows, no mirror in the floor."""
    model.vis.quality.shadowsize = SHADOW_SIZE
    model.vis.quality.numslices = 14
    model.vis.quality.numstacks = 8
    model.mat_reflectance[:] = 0.0


def _at_start(
    motion: Guidable, seed: int, place: Sequence[float] = (0.0, 0.0, 0.0)
) -> BaxterSimulation:
    from sim_bridge.baxter_simulation import BaxterSimulation
    from sim_bridge.simulation_settings import SimulationSettings

    settings = SimulationSettings(debris=PIECES, debris_seed=seed, object_place=tuple(place))
    simulation = BaxterSimulation(settings)
    positions = simulation.true_positions
    index = [simulation.joint_names.index(joint) for joint in motion.joints]
    positions[index], _ = motion.at(0.0)
    simulation.reset(positions=positions)
    return simulation
