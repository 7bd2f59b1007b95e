"""The numbers on `learner/progress/*`: what PlotJuggler, Foxglove and rqt_plot draw as they are."""

from __future__ import annotations

import math

from rclpy.node import Node
from std_msgs.msg import Float64

from irlpilco_ros.ros.learner_progress import LearnerProgress
from irlpilco_ros.ros.qos import DIAGNOSTICS


class ProgressNumbers:
    """Publishes each number of a learner's progress on a topic of its own."""

    def __init__(self, node: Node) -> None:
        """Make the publishers; nothing is told yet."""
        self._publishers = {
            "iteration": node.create_publisher(Float64, "learner/progress/iteration", DIAGNOSTICS),
            "fraction": node.create_publisher(Float64, "learner/progress/fraction", DIAGNOSTICS),
            "cost": node.create_publisher(Float64, "learner/progress/cost", DIAGNOSTICS),
            "error": node.create_publisher(Float64, "learner/progress/error", DIAGNOSTICS),
        }

    def publish(self, progress: LearnerProgress, error: float) -> None:
        """Tell what is known now; what is not known is not told, so that no plot has to skip it.

        Args:
            progress: Where the learner is.
            error: How far off the latest trial was [rad]; NaN before the first.
        """
        numbers = {
            "iteration": progress.iteration if progress.iteration >= 0 else math.nan,
            "fraction": progress.fraction,
            "cost": progress.cost,
            "error": error,
        }
        for name, number in numbers.items():
            if math.isfinite(number):
                self._publishers[name].publish(Float64(data=float(number)))
