"""Costs are of sources that exist. How they fit to the sizes of these is checked where sizes are allocated."""

from collections.abc import Sequence
from fnmatch import fnmatchcase

from jointplay.errors import not_known
from jointplay.file.schema import MechanismFile

from .graph import Graph
from .source import CompiledSource


def check_costs(data: MechanismFile, graph: Graph, sources: Sequence[CompiledSource]) -> None:
    """Refuse costs of what is no source.

    A clearance has one cost, whatever makes it: hole and pin, several bodies on one pin, both pins of a cross.
    """
    if not data.costs:
        return
    names = {source.name for source in sources if source.kind != "size"}
    pins = {graph.joints[source.spec["joint"]].pin for source in sources if source.kind == "clearance"}
    known = sorted(names | pins)
    for name in data.costs:
        if "*" in name:
            if not any(fnmatchcase(one, name) for one in known):
                raise graph.refuse(f"no source is called like '{name}'; there are {', '.join(known)}", f"costs.{name}")
        elif name not in known:
            raise graph.refuse(not_known(name, "a source", known), f"costs.{name}")
