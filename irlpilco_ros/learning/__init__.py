"""The learning core: Gaussian-process policy search with max-margin costs."""
