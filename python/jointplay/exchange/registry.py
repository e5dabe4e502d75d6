"""The formats by extension. A format is a module with ``read(path, options) -> Skeleton``."""

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType

from jointplay.errors import InputError, listed
from jointplay.file import toml

from . import asmt, dxf, freecad, linkage, mjcf, pmks, pylinkage, pyslvs, sdf, urdf, xacro
from .options import Options
from .skeleton import Skeleton
from .xml import parsed

Reader = Callable[[Path, Options], Skeleton]

#: by extension, in small letters
READERS: Mapping[str, Reader] = MappingProxyType(
    {
        ".urdf": urdf.read,
        ".sdf": sdf.read,
        ".mjcf": mjcf.read,
        ".dxf": dxf.read,
        ".json": pylinkage.read,
        ".xacro": xacro.read,
        ".fcstd": freecad.read,
        ".asmt": asmt.read,
        ".pyslvs": pyslvs.read,
        ".pmks": pmks.read,
        ".linkage2": linkage.read,
        ".url": pmks.read,
    }
)
#: formats of `.xml` by their root element
ROOTS: Mapping[str, Reader] = MappingProxyType({"robot": urdf.read, "sdf": sdf.read, "mujoco": mjcf.read})


def reader(path: Path) -> Reader:
    """The reader of a file.

    Raises
    ------
    InputError
        When no format has its extension, or the root element of an `.xml`.
    """
    kind = path.suffix.lower()
    if kind == ".xml":
        name, text = toml.read(path, "robot file")
        root = parsed(text, name).tag
        if root not in ROOTS:
            known = listed(f"<{tag}>" for tag in ROOTS)
            raise InputError(f"has the root element <{root}>; files of robots have one of {known}", file=name)
        return ROOTS[root]
    if kind == ".toml":
        raise InputError("is a mechanism already: load it with jp.load, or name it to a question", file=str(path))
    if kind not in READERS:
        what = f"'{kind}' is not the extension of a format that is read" if kind else "has no extension"
        raise InputError(f"{what}; known: {listed([*READERS, '.xml'])}", file=str(path))
    return READERS[kind]
