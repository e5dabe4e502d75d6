"""Linkages to begin with that are no examples: what somebody would draw, gesture by gesture."""

from collections.abc import Mapping

from jointplay.errors import InputError, not_known
from jointplay.file import document, toml

from .board import XY, Json
from .drafts import EMPTY
from .gestures import edits

#: bars by their ends, then places of pins to the ground, of the motor and of the output; the last point of a bar that
#: is drawn with a third one is a corner of it
TEMPLATES: Mapping[str, tuple[tuple[tuple[XY, ...], ...], tuple[XY, ...], XY, XY]] = {
    "watt-six-bar": (
        (
            ((0, 0), (20, 40)),
            ((20, 40), (110, 70)),
            ((110, 70), (90, 0), (150, 40)),
            ((150, 40), (230, 70)),
            ((230, 70), (210, 0)),
        ),
        ((0, 0), (90, 0), (210, 0)),
        (0, 0),
        (230, 70),
    ),
}


def template(name: str) -> str:
    """The text of a template.

    Raises
    ------
    InputError
        When there is none of that name.
    """
    if name not in TEMPLATES:
        raise InputError(not_known(name, "a template", TEMPLATES))
    bars, grounded, driven, output = TEMPLATES[name]
    text = document.edited(EMPTY, ("title",), name.replace("-", " ").capitalize())

    def there(place: XY) -> Json:
        """What a click would take."""
        raw = toml.parse(text)
        for joint, table in raw.get("joints", {}).items():
            if tuple(table["at"]) == place:
                return {"joint": joint}
        for body, points in raw.get("board", {}).get("free", {}).items():
            for index, point in enumerate(points):
                if tuple(point) == place:
                    return {"body": body, "index": index}
        return {"at": [*place]}

    def done(told: Json) -> str:
        found = text
        for steps, value in edits(toml.parse(text), {}, told)[0]:
            found = document.edited(found, steps, value)
        return found

    for number, (start, end, *corners) in enumerate(bars, 1):
        text = done({"gesture": "bar", "from": there(start), "to": there(end)})
        for corner in corners:
            text = done({"gesture": "point", "at": {"body": f"bar{number}", "at": [*corner]}})
    for place in grounded:
        text = done({"gesture": "ground", "at": there(place)})
    text = done({"gesture": "drive", **there(driven)})
    return done({"gesture": "output", "at": there(output)})
