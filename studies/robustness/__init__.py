"""The best fixed range in every world: all flock presets that have predators, under one protocol."""
