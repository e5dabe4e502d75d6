"""Mechanisms without a file: a builder whose methods write the tables of one."""
