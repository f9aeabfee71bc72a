"""Published results of other models and flocks, measured again with this simulator."""
