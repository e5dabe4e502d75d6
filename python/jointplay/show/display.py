"""What a notebook shows where a mechanism is the value of a cell: sentences, a drawing and tables, as HTML."""

import base64
import io
from collections.abc import Iterator
from html import escape

from jointplay.analyses import check
from jointplay.errors import InputError, JointplayError, one_line
from jointplay.model.mechanism import Mechanism
from jointplay.result.conclusions import conclude
from jointplay.result.table import tables
from jointplay.result.table.html import folded, paragraphs, table

try:
    from jointplay import plot
except InputError as missing:
    WITHOUT = str(missing)
else:
    WITHOUT = ""

#: most rows of joints that are shown without a click
FEW = 12


def html(m: Mechanism) -> str:
    """A mechanism as notebooks show it.

    Nothing is raised: what cannot be examined or drawn is said in its place.

    Returns
    -------
    str
        HTML without references to anything else.

    Examples
    --------
    >>> import jointplay as jp
    >>> shown = html(jp.loads(jp.examples.text("four-bar")))
    >>> "<img" in shown, "<table" in shown
    (True, True)
    """
    return f"<div><strong>{escape(one_line(m.title or m.file))}</strong>{''.join(_parts(m))}</div>"


def _parts(m: Mechanism) -> Iterator[str]:
    try:
        result = check.compute(m)
    except JointplayError as error:
        yield paragraphs([one_line(str(error))])
        return
    yield paragraphs([sentence.text for sentence in conclude(result).sentences])
    yield _picture(m)
    for number, found in enumerate(tables(result)):
        rows = max((len(column.cells) for column in found.columns), default=0)
        yield folded(found.title, table(found), is_open=number == 0 and rows <= FEW)


def _picture(m: Mechanism) -> str:
    """The drawing, or why there is none."""
    if WITHOUT:
        return paragraphs([f"There is no drawing: {WITHOUT}."])
    try:
        drawn = plot.mechanism(m)
    except JointplayError as error:
        return paragraphs([f"It cannot be drawn: {one_line(str(error))}."])
    content = io.BytesIO()
    drawn.savefig(content, format="png")
    source = f"data:image/png;base64,{base64.b64encode(content.getvalue()).decode()}"
    title = escape(one_line(m.title), quote=True)
    return f'<img alt="{title}" style="width: 100%; max-width: 44rem" src="{source}">'
