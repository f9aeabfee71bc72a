"""Episodes of many flocks: the batch of the compiled core, options, spaces, seeds."""
