"""Tables of standards, as data with their source: fits of holes and shafts, internal clearance of ball bearings."""

from .errors import NotInStandard
from .iso286 import SizeLimits, fit, limits, parse
from .iso5753 import GROUPS, travel

__all__ = ["GROUPS", "NotInStandard", "SizeLimits", "fit", "limits", "parse", "travel"]
