"""Train range policies and compare them with the grid search: ``python -m training --help``."""
