"""One adapter per interface over the shared batch."""
