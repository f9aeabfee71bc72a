"""The models as functions: simulate, sweep, neighbor graphs, records of runs."""
