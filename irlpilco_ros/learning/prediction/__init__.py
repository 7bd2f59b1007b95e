"""From a policy to the trajectory that the model expects of it, and what that costs."""
