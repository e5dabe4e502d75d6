"""Readings of a built machine: what was read, and what the mechanism says would be read.

    reading = h(drives, load case; deviations) + play + noise

`table` makes numbers of a table, by the names of the mechanism; `channels` says what a column measures; `model` has h
with its derivatives, and the covariance of the play.
"""

from .channels import OUTPUT, Channel, channel, names_of
from .frames import FRAME_COLUMNS, DeviceFrame, by_frame_of, nearest_frame
from .model import Predicted, ReadingModel
from .table import APPROACH, LOAD_CASE, Readings, readings, require_whole

__all__ = [
    "APPROACH",
    "FRAME_COLUMNS",
    "LOAD_CASE",
    "OUTPUT",
    "Channel",
    "DeviceFrame",
    "Predicted",
    "ReadingModel",
    "Readings",
    "by_frame_of",
    "channel",
    "names_of",
    "nearest_frame",
    "readings",
    "require_whole",
]
