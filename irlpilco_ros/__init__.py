"""One-shot apprenticeship learning (IRL/PILCO) for velocity-controlled robots, as ROS 2 nodes."""
