"""What is measured on the cart-pole beyond the thesis's chapter: `irlpilco study cart-pole`."""

from __future__ import annotations

from irlpilco_ros.studies.cart_pole import mc_pilco
from irlpilco_ros.studies.cart_pole.mc_pilco_table import mc_pilco_table
from irlpilco_ros.studies.experiment import Experiment

EXPERIMENTS = {mc_pilco.EXPERIMENT: Experiment(mc_pilco.jobs, mc_pilco_table)}
"""The parts by name."""
