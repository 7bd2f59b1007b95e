"""The ROS 2 nodes: thin shells around code that knows nothing of ROS."""
