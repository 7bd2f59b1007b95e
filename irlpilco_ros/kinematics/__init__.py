"""Where a robot's tools are: kinematics from its URDF, and the way back from poses to joints.

The kinematics are MuJoCo's, which reads URDF, gives Jacobians and is a dependency already.
Pinocchio would do as well, but is a second library of rigid bodies, with some eight compiled
packages that nothing else here needs. Everybody who imports `robot_kinematics` loads MuJoCo; the
other files of this room need numpy and scipy alone.
"""
