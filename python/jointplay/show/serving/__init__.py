"""The studio: a local page to play with a mechanism. What has to be known of it is in its parts.

    folder     which files a page may open and save
    session    what is kept for a page between its questions
    answers    what the page shows, while sliders move and when they rest
    server     who may ask, and what is answered
    door       connections: how many, for how long, and who is heard
    replies    the headers of every answer
    browsing   how the browser is led to the page

The page is `page.html`, `studio.css` and two ECMAScript modules, `studio.js` and `charts.js`, as they are written; the
drawing is that of `viewer`.
"""

from .browsing import leading_to
from .server import serve

__all__ = ["leading_to", "serve"]
