"""From joint states to commands, and when to stop: what moves a robot, without ROS."""
