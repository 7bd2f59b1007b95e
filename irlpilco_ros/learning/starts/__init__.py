"""Policies to start from: for the first trial, and for every policy search."""
