"""Moments of functions of Gaussians: the steps of a predicted trajectory."""
