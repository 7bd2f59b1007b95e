"""Measurements of what the project claims: jobs over seeds, tables and figures."""
