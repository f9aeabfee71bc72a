"""Pictures of flocks and lines, in environments and of recorded runs. Needs the ``video`` extra.

The first picture loads pygame. Importing this package does not.
"""
