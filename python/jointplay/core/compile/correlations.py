"""Correlated sources: from rank correlations to what makes normal scores of independent ones.

In a Gaussian copula scores with the correlation rho have the rank correlation `(6 / pi) asin(rho / 2)` (Pearson 1907):

    rho = 2 sin(pi rank / 6),  rho = L L'

which is possible where the matrix of rho has no negative eigenvalue.
"""

from collections.abc import Sequence

import numpy as np

from jointplay.core.spec import CorrelationSpec
from jointplay.errors import listed, not_known
from jointplay.file.schema import MechanismFile

from .graph import Graph
from .source import LOOSE, CompiledSource

#: eigenvalues below this part of the largest one are rounding
ROUNDING = 1e-10


def _is_single(source: CompiledSource) -> bool:
    return source.kind not in LOOSE and len(source.components) == 1


def compile_correlations(data: MechanismFile, graph: Graph, sources: Sequence[CompiledSource]) -> list[CorrelationSpec]:
    """The groups of correlated sources, by index."""
    names = [source.name for source in sources]
    taken: dict[int, int] = {}
    groups: list[CorrelationSpec] = []
    for number, entry in enumerate(data.correlations):
        key = f"correlations.{number}"
        indices: list[int] = []
        for k, name in enumerate(entry.sources):
            place = f"{key}.sources.{k}"
            if name not in names:
                single = [source.name for source in sources if _is_single(source)]
                raise graph.refuse(not_known(name, "a source", single), place)
            index = names.index(name)
            if not _is_single(sources[index]):
                problem = (
                    f"'{name}' is not a single number: where a pin lies in its hole, or a gearbox between its flanks,"
                    " is not correlated, but sizes, dimensions, angles, ratio errors and drive errors are"
                )
                raise graph.refuse(problem, place)
            if index in taken:
                raise graph.refuse(f"'{name}' is correlated in correlations.{taken[index]} already", place)
            taken[index] = number
            indices.append(index)
        rho = 2.0 * np.sin(np.pi / 6.0 * np.array(entry.matrix))
        values, vectors = np.linalg.eigh(rho)
        if values[0] < -ROUNDING * values[-1]:
            # The weights that would make a sum of scores of negative variance.
            weight = np.abs(vectors[:, 0])
            among = [entry.sources[k] for k in np.flatnonzero(weight > 0.1 * weight.max())]
            problem = (
                f"no numbers have these rank correlations: the matrix of {listed(among)} has a negative eigenvalue,"
                f" {values[0]:.3g}"
            )
            raise graph.refuse(problem, f"{key}.{'rank' if entry.rank is not None else 'ranks'}")
        kept = values > ROUNDING * values[-1]
        factor = vectors[:, kept] * np.sqrt(values[kept])
        factor /= np.linalg.norm(factor, axis=1)[:, None]
        groups.append({"sources": indices, "factor": factor.tolist()})
    return groups
