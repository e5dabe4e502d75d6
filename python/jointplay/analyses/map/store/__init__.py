"""Where the chunks of a map are kept while it is made: in memory, or in a file that survives the end of the program."""

from .checks import Stamps
from .chunks import ChunkStore, open_store
from .memory import MemoryStore
from .plan import Store, StorePlan
from .writer import Writer

__all__ = ["ChunkStore", "MemoryStore", "Stamps", "Store", "StorePlan", "Writer", "open_store"]
