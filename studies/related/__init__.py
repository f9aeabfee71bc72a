"""A related result: a bandit over fixed ranges."""
