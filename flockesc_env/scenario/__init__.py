"""Scenarios: dataclasses of the models' parameters, presets, documents (JSON, TOML)."""
