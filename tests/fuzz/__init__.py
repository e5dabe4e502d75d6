"""Damaged files, mutated mechanisms, random commands and damaged maps: whatever they are, the answer is one of a few.

A case is a kind and a number, from which all of it follows. `make fuzz` goes through many.
"""
