"""The work on a map: chunk by chunk outwards from the start, then again where a neighbour opened a new way in.

A chunk is solved from the states on the faces of the chunks around it that are done. A region that winds may be
entered later from another side; further passes solve such chunks again until nothing is added. All of it depends on
the mechanism and the grid only, so that a run that was killed and taken up ends as one that was not.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from jointplay.analyses.nominal import Floats, Nominal, Progress
from jointplay.cluster import RETRIED, Here, Workers
from jointplay.store import ChunkStore, Store

from .answering import NOT_ASSEMBLED, Answer, Array, Asking, face, faces
from .contact import Contacts
from .lattice import Neighbour
from .reach import Reach, Seeds

#: passes after which the work ends in any case; a region would have to wind as often in and out of a chunk
MOST_PASSES = 100
OK = 0


class Work:
    """A map in the making.

    Parameters
    ----------
    asking : Asking
        The question.
    store : Store
        Where chunks go, and where an earlier run stopped.
    workers : Here or Workers
        Who is asked.
    """

    def __init__(self, asking: Asking, store: Store, workers: Here | Workers) -> None:
        self.asking, self.store, self.workers = asking, store, workers
        self.m, self.lattice = asking.ask.m, asking.lattice
        #: where workers write by themselves
        self.shared = store if isinstance(store, ChunkStore) and workers.is_remote else None
        self.reach = Reach(self.m, self.lattice.grid)
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
        while number <= MOST_PASSES:
            added = False
            for answer in self._answers(self._way(number, done)):
                told(self._keep(answer))
                added = True
            # A pass that was taken up in its middle may have added something before.
            if not added and done == 0:
                break
            number, done = number + 1, 0
        self.store.advance((MOST_PASSES + 1, 0))
        self._join()
        self.store.finish({RETRIED: self.workers.retried} if self.workers.retried else {})

    def _answers(self, way: Iterator[tuple[int, Nominal]]) -> Iterator[Answer]:
        """The answers at the chunks of a way, in their order."""
        if self.shared is None:
            return self.workers.each(Asking.__call__, (self.asking,), way)
        return self._written(self.shared, way)

    def _written(self, shared: ChunkStore, way: Iterator[tuple[int, Nominal]]) -> Iterator[Answer]:
        """The same where workers write; the first answer makes the room for all."""
        if (writer := shared.writer()) is None:
            yield from self.workers.each(Asking.__call__, (self.asking,), islice(way, 1))
            writer = shared.writer()
        yield from self.workers.each(Asking.__call__, (self.asking.writing(writer),), way)

    def _way(self, number: int, done: int) -> Iterator[tuple[int, Nominal]]:
        """The configurations at the nodes of the chunks that a pass has to ask, as far as they are reached."""
        for place in range(done, len(self.order)):
            chunk = self.order[place]
            seeds, offered = self._ways_in(chunk)
            if offered is None:
                continue
            at = self.reach.solve(self.lattice, chunk, Seeds.of(seeds))
            size = self.lattice.size(chunk)
            kept: dict[str, Array] = {"status": at.status.reshape(size)}
            kept["poses"] = at.poses.reshape(*size, *at.poses.shape[1:])
            entry = {f"seen.{side}": ok for side, ok in offered.items()} | faces(self.lattice, chunk, kept)
            self.ahead[chunk] = (number, place + 1), entry
            if self.shared is not None:
                self.shared.announce(chunk)
            yield chunk, at

    def _keep(self, answer: Answer) -> tuple[int, int]:
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

    def _ways_in(self, number: int) -> tuple[list[Seeds], dict[str, NDArray[np.bool_]] | None]:
        """States that lead into a chunk, and the nodes beyond its faces that are ok, by the face.

        None in place of the latter where it was solved before and nothing new leads into it.
        """
        own = self._entry(number)
        offered: dict[str, NDArray[np.bool_]] = {}
        seeds = [self.starts.get(number, self.reach.no_seeds)]
        opened = own is None
        for neighbour in self.lattice.neighbours(number):
            side = f"{neighbour.axis}.{neighbour.side}"
            other = self._entry(neighbour.number)
            if other is None:
                continue
            opposite = f"{neighbour.axis}.{1 - neighbour.side}"
            offered[side] = other[f"status.{opposite}"] == OK
            seeds.append(self._seeds(number, neighbour, offered[side], other[f"poses.{opposite}"]))
            if own is not None:
                seen = own[f"seen.{side}"] if f"seen.{side}" in own else np.zeros_like(offered[side])
                opened |= bool((offered[side] & ~seen & (own[f"status.{side}"] == NOT_ASSEMBLED)).any())
        return seeds, offered if opened else None

    def _seeds(self, number: int, neighbour: Neighbour, ok: NDArray[np.bool_], poses: Floats) -> Seeds:
        """The states on the face of a neighbour, each with the node of this chunk that is next to it."""
        size, theirs = self.lattice.size(number), self.lattice.size(neighbour.number)
        nodes = np.arange(np.prod(size)).reshape(size)
        rows = self.reach.commands(self.lattice, neighbour.number)
        rows = face(rows.reshape(*theirs, -1), neighbour.axis, 1 - neighbour.side)
        mine = face(nodes, neighbour.axis, neighbour.side)
        return Seeds(mine[ok], rows[ok], poses[ok])

    def _join(self) -> None:
        """Mark changes of contact between the last nodes of a chunk and the first ones of the next."""
        contacts = Contacts(self.m)
        for number in range(len(self.lattice)):
            own = self.store.entry(number)
            if own is None or not any(name.startswith("contacts.") for name in own):
                continue
            region = self.lattice.region(number)
            marked = self.store.values("contact_change", region)
            for neighbour in self.lattice.neighbours(number):
                other = self.store.entry(neighbour.number)
                if neighbour.side == 0 or other is None:
                    continue
                axis = neighbour.axis
                changed = contacts.change(own[f"contacts.{axis}.1"], other[f"contacts.{axis}.0"])
                np.moveaxis(marked[..., axis], axis, 0)[-1] = changed
            self.store.replace(number, "contact_change", region, marked)
