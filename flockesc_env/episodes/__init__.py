"""Episodes of many flocks: the wrapper around the core's batch, options, spaces, seeds."""
