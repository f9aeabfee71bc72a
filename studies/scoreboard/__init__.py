"""The scoreboard: training and scores of all learners, what normalizes scores, and the page."""
