"""Simulated robots (MuJoCo) under the topic names of the real ones."""
