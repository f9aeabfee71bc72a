"""Reproduction of the paper: its figures, its claims with measurements, its slips."""
