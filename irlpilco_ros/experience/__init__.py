"""What was recorded: trajectories, MCAP bags and the run directory."""
