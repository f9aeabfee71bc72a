"""The benchmark's study: its frozen tasks, baselines at equal samples, and the page of submissions."""
