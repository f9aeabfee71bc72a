"""Training of range policies and comparison with the grid search: ``python -m training --help``."""
