"""Scenarios: the parameters of the models, presets, and their JSON and TOML form."""
