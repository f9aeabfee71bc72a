"""Training of range policies and figures beside the grid search: ``python -m training --help``."""
