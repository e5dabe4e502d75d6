"""Mechanisms of foreign formats, in and out.

Reading is three steps: a format becomes a `skeleton.Skeleton`, the skeleton is shaped by the options of the import, and
`text` writes it as a mechanism file, which is then read like any other.
"""
