"""The beginning of every page that is written to a file or handed to a notebook, with what such a page may do."""

from html import escape

from jointplay.errors import one_line

#: nothing is fetched from anywhere and nothing is sent, whatever names and titles of a file contain; a picture that a
#: page draws itself may be saved
POLICY = (
    "default-src 'none'; img-src data: blob:; style-src 'unsafe-inline'; script-src 'unsafe-inline';"
    " base-uri 'none'; form-action 'none'"
)


def head(title: str, style: str = "", more: str = "") -> str:
    """The beginning of a page, up to the end of its head.

    Parameters
    ----------
    title : str
        As text.
    style : str
        Its style sheet.
    more : str
        Further elements, in HTML.

    Examples
    --------
    >>> print(head("bars < 3", "body { margin: 0 }"))  # doctest: +ELLIPSIS
    <!DOCTYPE html>
    <html lang="en"><head><meta charset="utf-8">...<title>bars &lt; 3</title><style>body { margin: 0 }</style></head>
    """
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">'
        f"<title>{escape(one_line(title))}</title>{more}<style>{style}</style></head>"
    )
