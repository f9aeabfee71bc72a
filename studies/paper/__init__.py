"""The paper reproduced: its figures, its claims beside measurements, its slips."""
