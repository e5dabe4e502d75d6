"""How a browser is led to the page without its address, which has the token in it, on a command line.

Every user of a machine can read the command lines of all programs. So the browser is given a page in a folder that only
its owner may enter, which leads on to the address. A token that works once would be no better: whoever watches command
lines could be faster than the browser is.
"""

import json
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from html import escape
from pathlib import Path

from jointplay.basics import pages

BODY = '<body><p><a href="{href}">jointplay studio</a></p><script>location.replace({address})</script></body></html>\n'


@contextmanager
def leading_to(address: str) -> Iterator[str]:
    """The address of a page that leads to an address, as long as it is there.

    Yields
    ------
    str
        A ``file:`` address.
    """
    with tempfile.TemporaryDirectory(prefix="jointplay-", ignore_cleanup_errors=True) as folder:
        place = Path(folder, "studio.html")
        content = pages.head("jointplay studio") + BODY.format(href=escape(address), address=json.dumps(address))
        # The folder is its owner's alone already; the mode of the file does not rest on that.
        with os.fdopen(os.open(place, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w", encoding="utf-8") as stream:
            stream.write(content)
        yield place.as_uri()
