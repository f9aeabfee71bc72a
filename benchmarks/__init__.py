"""Speed of this project beside that of its peers, measured in one run: ``python -m benchmarks run``."""

PROJECT = "flockesc_env"
"""What this project is called in tables and figures."""
