"""The studio: a local page to play with a mechanism. What has to be known of it is in its four parts.

    folder     which files a page may open and save
    session    what is kept for a page between its questions
    answers    what the page shows, while sliders move and when they rest
    server     who may ask, and how

The page is `page.html`, `studio.css` and two ECMAScript modules, `studio.js` and `charts.js`, as they are written; the
drawing is that of `viewer`.
"""

from .server import serve

__all__ = ["serve"]
