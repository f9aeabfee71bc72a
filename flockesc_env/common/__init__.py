"""Helpers that know no model: errors, argument checks, files, extras, progress bars, statistics."""
