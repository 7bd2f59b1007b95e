"""One-shot apprenticeship learning (IRL/PILCO) for velocity-controlled robots, as ROS 2 nodes."""

__version__ = "0.1.0"
"""Also in package.xml."""
