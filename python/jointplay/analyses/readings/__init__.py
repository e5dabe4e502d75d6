"""Readings of a built machine: what was read, and what the mechanism says would be read.

    reading = h(drives, load case; deviations) + play + noise

`table` makes numbers of a table, by the names of the mechanism; `channels` says what a column measures; `model` has h
with its derivatives, and the covariance of the play.
"""

from .channels import OUTPUT, Channel, channel, names_of
from .model import DeviceFrame, Predicted, ReadingModel
from .table import APPROACH, LOAD_CASE, Readings, readings

__all__ = [
    "APPROACH",
    "LOAD_CASE",
    "OUTPUT",
    "Channel",
    "DeviceFrame",
    "Predicted",
    "ReadingModel",
    "Readings",
    "channel",
    "names_of",
    "readings",
]
