"""The best fixed range in every flock preset with predators, under one protocol."""
