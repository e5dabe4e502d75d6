"""Damaged files, unusual mechanisms, random commands, damaged maps and signals: the answer is one of a few.

A case is a kind and a number, from which all of it follows. `make fuzz` goes through many.
"""
