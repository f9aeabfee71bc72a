"""Environments: Gymnasium, Gymnasium vector and PettingZoo interfaces to ``FlockBatch`` and the line."""
