"""Simulation, grid search, neighbor graphs and recorded runs of both models."""
