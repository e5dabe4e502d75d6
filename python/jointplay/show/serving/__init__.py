"""The studio: a local page to play with a mechanism. What has to be known of it is in its parts.

    folder     which files a page may open and save
    drafts     a text that is being drawn, and what is missing for an answer
    board      what a page draws and can take hold of
    gestures   what a person does, as edits of the text
    session    what is kept for a page between its questions
    answers    what the page shows, while sliders move and when they rest
    server     who may ask, and what is answered
    door       connections: how many, for how long, and who is heard
    replies    the headers of every answer
    browsing   how the browser is led to the page

The page is `page.html`, `studio.css` and ECMAScript modules, as they are written: `studio.js` asks and shows,
`board.js` has the tools, `inspector.js` the properties, `history.js` what can be undone; the drawing is that of
`viewer`. It keeps no mechanism: it shows what the server says of a text, and sends edits of it.
"""

from .browsing import leading_to
from .server import serve

__all__ = ["leading_to", "serve"]
