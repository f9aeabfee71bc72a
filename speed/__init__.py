"""Benchmarks of this project and its peers, measured in one run: ``python -m speed run``."""

PROJECT = "flockesc_env"
"""Name of this project in tables and figures."""
