"""Related results: a bandit over fixed ranges, and the best topological k against the predator's speed."""
