"""The benchmark: frozen tasks, normalized scores and results that anyone can verify bit for bit."""
