"""The work on a map: chunk by chunk outwards from the start, then again where a neighbour opened a new way in.

A chunk is solved from the states on the faces of the chunks around it that are done. A region that winds may be
entered later from another side; further passes solve such chunks again until nothing is added. Then as many passes go
on from nodes behind singular poses, which lead to others of their kind. All of it depends on the mechanism and the grid
only, so that a run that was killed and taken up ends as one that was not.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import islice

import numpy as np

from jointplay.analyses.cluster import RETRIED, Here, Workers
from jointplay.analyses.nominal import Progress
from jointplay.basics.arrays import Array, Codes, Floats
from jointplay.result import STATUSES

from .answering import CROSSING, NOT_ASSEMBLED, Chunk, ChunkAnswer, ChunkAsking, face, faces
from .contact import Contacts
from .lattice import Neighbour
from .reach import BEYOND, GridFollower, Seeds
from .store import ChunkStore, Store

#: passes after which the work ends in any case; a region would have to wind as often in and out of a chunk
MOST_PASSES = 100
#: the last of the passes from nodes behind singular poses, and where the work ends
LAST_PASS = 2 * MOST_PASSES
OK, OTHER_BRANCH = 0, STATUSES.tolist().index(BEYOND)
#: what a node offers to its neighbour: nothing, a way behind singular poses, a way
NO_WAY, WAY_BEYOND, WAY = 0, 1, 2


@dataclass(frozen=True)
class WayIn:
    """States that lead into a chunk."""

    #: the face behind which they are; empty where they are none of a neighbour
    side: str
    #: what the nodes behind the face offer
    offered: Codes
    #: those that offer something, in their order
    seeds: Seeds


class Work:
    """A map in the making.

    Parameters
    ----------
    asking : ChunkAsking
        The question.
    store : Store
        Where chunks go, and where an earlier run stopped.
    workers : Here or Workers
        Who is asked.
    """

    def __init__(self, asking: ChunkAsking, store: Store, workers: Here | Workers) -> None:
        self.asking, self.store, self.workers = asking, store, workers
        self.m, self.lattice = asking.ask.m, asking.lattice
        #: where workers write by themselves
        self.shared = store if isinstance(store, ChunkStore) and workers.is_remote else None
        self.reach = GridFollower(self.m, self.lattice.grid)
        self.starts = self.reach.starts(self.lattice)
        self.order = self.lattice.order(next(iter(self.starts), 0))
        #: chunks whose nodes are solved and whose answers are not here yet: the position after each, and its entry
        self.ahead: dict[int, tuple[tuple[int, int], dict[str, Array]]] = {}

    def run(self, progress: Progress | None = None) -> None:
        """Do what is left."""
        number, done = self.store.resume(self.order)

        def told(position: tuple[int, int]) -> None:
            if progress is not None and position < (1, len(self.order)):
                progress(position[1], len(self.order))

        told((number, done))
        while number <= LAST_PASS:
            added = False
            for answer in self._answers(self._way(number, done)):
                told(self._keep(answer))
                added = True
            # A pass that was taken up in its middle may have added something before.
            if not added and done == 0:
                number = LAST_PASS if number > MOST_PASSES else MOST_PASSES
            number, done = number + 1, 0
        self.store.advance((LAST_PASS + 1, 0))
        self._join()
        self.store.finish({RETRIED: self.workers.retried} if self.workers.retried else {})

    def _answers(self, way: Iterator[Chunk]) -> Iterator[ChunkAnswer]:
        """The answers at the chunks of a way, in their order."""
        if self.shared is None:
            return self.workers.each(ChunkAsking.__call__, (self.asking,), way)
        return self._written(self.shared, way)

    def _written(self, shared: ChunkStore, way: Iterator[Chunk]) -> Iterator[ChunkAnswer]:
        """The same where workers write; the first answer makes the room for all."""
        if (writer := shared.writer()) is None:
            yield from self.workers.each(ChunkAsking.__call__, (self.asking,), islice(way, 1))
            writer = shared.writer()
        yield from self.workers.each(ChunkAsking.__call__, (self.asking.writing(writer),), way)

    def _way(self, number: int, done: int) -> Iterator[Chunk]:
        """The configurations at the nodes of the chunks that a pass has to ask, as far as they are reached."""
        for place in range(done, len(self.order)):
            chunk = self.order[place]
            ways = self._ways_in(chunk, beyond=number > MOST_PASSES)
            if ways is None:
                continue
            found = self.reach.solve(self.lattice, chunk, Seeds.of([way.seeds for way in ways]))
            size = self.lattice.size(chunk)
            kept: dict[str, Array] = {"status": found.at.status.reshape(size)}
            kept["poses"] = found.at.poses.reshape(*size, *found.at.poses.shape[1:])
            entry = faces(self.lattice, chunk, kept)
            ends = np.cumsum([len(way.seeds) for way in ways])[:-1]
            for way, crossing in zip(ways, np.split(found.seed_crossing, ends), strict=True):
                if way.side:
                    entry[f"seen.{way.side}"] = way.offered
                    entry[f"{CROSSING}.{way.side}"] = np.full(way.offered.shape, np.nan)
                    entry[f"{CROSSING}.{way.side}"][way.offered != NO_WAY] = crossing
            self.ahead[chunk] = (number, place + 1), entry
            if self.shared is not None:
                self.shared.announce(chunk)
            yield chunk, found.at, found.crossing

    def _keep(self, answer: ChunkAnswer) -> tuple[int, int]:
        """Keep the answer at the first chunk that waits for one; the position after it."""
        chunk = next(iter(self.ahead))
        position, entry = self.ahead[chunk]
        entry |= answer.contacts
        if answer.part is not None:
            self.store.begin(answer.part)
            self.store.put(chunk, self.lattice.region(chunk), answer.part, entry)
        elif self.shared is not None:
            self.shared.record(chunk, entry, answer.stamps)
        del self.ahead[chunk]
        self.store.advance(position)
        return position

    def _entry(self, number: int) -> Mapping[str, Array] | None:
        """What the neighbours of a chunk need to know of it; None when it was never solved."""
        return self.ahead[number][1] if number in self.ahead else self.store.entry(number)

    def _ways_in(self, number: int, *, beyond: bool) -> list[WayIn] | None:
        """What leads into a chunk; None where it was solved before and nothing new leads into it."""
        own = self._entry(number)
        ways = [WayIn("", np.zeros(0, np.uint8), self.starts.get(number, self.reach.no_seeds))]
        opened = own is None
        for neighbour in self.lattice.neighbours(number):
            side = f"{neighbour.axis}.{neighbour.side}"
            other = self._entry(neighbour.number)
            if other is None:
                continue
            opposite = f"{neighbour.axis}.{1 - neighbour.side}"
            status = other[f"status.{opposite}"]
            offered = np.where(status == OK, WAY, NO_WAY).astype(np.uint8)
            if beyond:
                offered[status == OTHER_BRANCH] = WAY_BEYOND
            ways.append(WayIn(side, offered, self._seeds(number, neighbour, offered, other[f"poses.{opposite}"])))
            if own is not None:
                seen = own[f"seen.{side}"] if f"seen.{side}" in own else np.zeros_like(offered)
                mine = own[f"status.{side}"]
                is_open = (mine == NOT_ASSEMBLED) | ((mine == OTHER_BRANCH) & (offered == WAY))
                opened |= bool(((offered > seen) & is_open).any())
        return ways if opened else None

    def _seeds(self, number: int, neighbour: Neighbour, offered: Codes, poses: Floats) -> Seeds:
        """The states on the face of a neighbour, each with the node of this chunk that is next to it."""
        size, theirs = self.lattice.size(number), self.lattice.size(neighbour.number)
        nodes = np.arange(np.prod(size)).reshape(size)
        rows = self.reach.commands(self.lattice, neighbour.number)
        rows = face(rows.reshape(*theirs, -1), neighbour.axis, 1 - neighbour.side)
        mine, chosen = face(nodes, neighbour.axis, neighbour.side), offered != NO_WAY
        return Seeds(mine[chosen], rows[chosen], poses[chosen], offered[chosen] == WAY_BEYOND)

    def _join(self) -> None:
        """Mark what lies between the last nodes of a chunk and the first ones of the next."""
        contacts = Contacts(self.m)
        for number in range(len(self.lattice)):
            own = self.store.entry(number)
            if own is None:
                continue
            region = self.lattice.region(number)
            found: dict[str, Array] = {}
            for neighbour in self.lattice.neighbours(number):
                other = self.store.entry(neighbour.number)
                if neighbour.side == 0 or other is None:
                    continue
                axis = neighbour.axis
                before, after = f"{axis}.1", f"{axis}.0"
                marks: dict[str, Array] = {}
                if f"contacts.{before}" in own:
                    marks["contact_change"] = contacts.change(own[f"contacts.{before}"], other[f"contacts.{after}"])
                crossing = _crossing(own.get(f"{CROSSING}.{before}"), other.get(f"{CROSSING}.{after}"))
                if np.isfinite(crossing).any():
                    marks[CROSSING] = crossing
                for name, values in marks.items():
                    if name not in found:
                        found[name] = self.store.values(name, region)
                    np.moveaxis(found[name][..., axis], axis, 0)[-1] = values
            for name, values in found.items():
                self.store.replace(number, name, region, values)


def _crossing(backwards: Array | None, forwards: Array | None) -> Array:
    """Where ways between two chunks end, as the part of the way forwards."""
    missing = np.array(np.nan)
    back = missing if backwards is None else 1.0 - backwards
    ahead = missing if forwards is None else forwards
    return np.where(np.isfinite(back), back, ahead)
