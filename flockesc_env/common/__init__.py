"""Helpers independent of the models: errors, argument checks, files, extras, progress bars, statistics."""
