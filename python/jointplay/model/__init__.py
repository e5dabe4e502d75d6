"""The mechanism: read from a file, written in Python, written out, changed, sized, and how it can move."""
