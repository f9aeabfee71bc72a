"""Errors, argument checks, files, progress bars, statistics: helpers that know no model."""
