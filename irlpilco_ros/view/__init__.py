"""A run or a bag in the browser: the robot in 3-D, and what it did over time.

`page` and `robot_drawing` draw with viser, an optional dependency; the other files do without.
"""
