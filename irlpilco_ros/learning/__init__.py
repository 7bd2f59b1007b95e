"""Learning from a demonstration (IRL/PILCO) or from a cost (PILCO), with numpy and scipy alone.

`for iteration in apprenticeship(task, settings, run_trial)` is all there is to it;
examples/two_joints.py is the shortest complete program.
"""

from irlpilco_ros.learning.apprenticeship import LearningLoop, apprenticeship, pilco
from irlpilco_ros.learning.iteration import Iteration, Progress
from irlpilco_ros.learning.judgement import Errors, judge
from irlpilco_ros.learning.learning_settings import LearningSettings
from irlpilco_ros.learning.rollout import Rollout
from irlpilco_ros.learning.task import Task

__all__ = [
    "Errors",
    "Iteration",
    "LearningLoop",
    "LearningSettings",
    "Progress",
    "Rollout",
    "Task",
    "apprenticeship",
    "judge",
    "pilco",
]
