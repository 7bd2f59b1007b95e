"""Gaussian-process models of the dynamics: kernel, evidence, training, posterior."""
