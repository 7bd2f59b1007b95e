"""How time passes in a simulation."""

from __future__ import annotations

from dataclasses import dataclass

from irlpilco_ros.learning.settings import setting


@dataclass(frozen=True)
class PaceSettings:
    """Settings that every simulated robot has."""

    seed: int = setting(
        0, "Seed of the sensor noise, and of random starts.", minimum=0, read_only=True
    )
    real_time_factor: float = setting(
        1.0,
        "Simulated seconds per second; 0: as fast as it goes. Other than 1, /clock is published.",
        minimum=0.0,
        maximum=1000.0,
        read_only=True,
    )
    lockstep: bool = setting(
        False,
        "Wait for the answer to each state (a command or a guide), as fast as it goes: the same "
        "seed gives the same trial bit for bit. Publishes /clock.",
        read_only=True,
    )

    @property
    def wall_time(self) -> bool:
        """Whether the simulation keeps the wall clock's time, so that nobody needs /clock."""
        return self.real_time_factor == 1.0 and not self.lockstep

    def sentence(self) -> str:
        """Say how time passes."""
        if self.lockstep:
            return "time waits for an answer to each joint state (lockstep)"
        if self.real_time_factor == 0.0:
            return "time runs as fast as it goes"
        factor = self.real_time_factor
        return "in real time" if factor == 1.0 else f"{factor:g} simulated seconds per second"
