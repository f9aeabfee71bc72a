"""Arms race: predators and flock policies trained against each other, and their cross-play."""
