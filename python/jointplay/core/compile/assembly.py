"""The order of assembly: names become indices, and every body is added once."""

from dataclasses import dataclass

from jointplay.errors import listed, not_known
from jointplay.file.schema import MechanismFile

from .graph import GROUND, GROUND_INDEX, Graph


@dataclass(frozen=True)
class AssemblyOrder:
    """An order of assembly."""

    #: index of the body that everything is assembled on; -1 is the ground
    base: int
    #: indices of the bodies that each step adds
    steps: tuple[tuple[int, ...], ...]


def compile_assembly(data: MechanismFile, graph: Graph) -> AssemblyOrder | None:
    """Check the order of assembly; None where the file has none.

    Crosses of universal joints are not named: each comes with the second of its joint's two bodies.
    """
    if data.assembly is None:
        return None
    known = [GROUND, *(name for index, name in enumerate(graph.bodies) if index not in graph.crosses)]
    base = data.assembly.base
    if base not in known:
        raise graph.refuse(not_known(base, "a body of any joint", known), "assembly.base")
    added: dict[str, int] = {}
    for k, step in enumerate(data.assembly.steps):
        for i, name in enumerate(step):
            key = f"assembly.steps.{k}.{i}"
            if name not in known:
                raise graph.refuse(not_known(name, "a body of any joint", known), key)
            if name == base:
                raise graph.refuse(f"'{name}' is the base and there from the beginning", key)
            if name in added:
                raise graph.refuse(f"'{name}' is added already, in assembly.steps.{added[name]}", key)
            added[name] = k
    missing = [f"'{name}'" for name in known if name != base and name not in added]
    if missing:
        raise graph.refuse(f"every body is added once; missing: {listed(missing)}", "assembly.steps")

    def index(name: str) -> int:
        return GROUND_INDEX if name == GROUND else graph.bodies.index(name)

    return AssemblyOrder(index(base), tuple(tuple(map(index, step)) for step in data.assembly.steps))
