"""What files and links of other programs look like, for those that do not read them."""

import re

#: extensions of files that are imported, and are nothing else, in small letters
EXTENSIONS = (".urdf", ".xacro", ".sdf", ".mjcf", ".dxf", ".fcstd", ".asmt", ".pyslvs", ".pmks", ".linkage2", ".url")
#: a link with a drawing in it, also as browsers show it
LINK = re.compile(r"(?:https?://|app\.pmksplus\.com/?\?)\S*", re.IGNORECASE)


def is_link(place: str) -> bool:
    """Whether it is a link instead of a path."""
    return bool(LINK.match(place))
