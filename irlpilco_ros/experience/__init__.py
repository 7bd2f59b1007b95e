"""What was recorded: trajectories with names and stamps, MCAP bags, the run directory."""
