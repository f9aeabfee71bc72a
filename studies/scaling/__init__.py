"""Which range is best in flocks of other sizes, dimensions, speeds and noise: a law, and its mechanism."""
