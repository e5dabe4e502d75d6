"""Films somebody who draws a four-bar from nothing to its verdict: the animation on the page about the studio.

Written anew with ``PYTHONPATH=tests python -m helpers.film docs/drawn.gif``.
"""

import base64
import sys
import tempfile
from io import BytesIO
from pathlib import Path

from PIL import Image

from helpers.browser import Page, opened
from helpers.studio import EXACT, Person, choose, served
from jointplay.show.serving.answers import PATIENCE

#: what is seen of the page, and how much smaller the film is
WIDTH, HEIGHT, SCALE = 1180, 800, 0.7
COLOURS = 160
#: milliseconds of a frame, and of the last one
SHOWN, LAST = 600, 4000


def frame(page: Page) -> Image.Image:
    """What is on the screen."""
    page.run("scrollTo(0, 0)")
    clip = {"x": 0, "y": 0, "width": WIDTH, "height": HEIGHT, "scale": SCALE}
    found = page.ask("Page.captureScreenshot", clip=clip)
    return Image.open(BytesIO(base64.b64decode(found["data"]))).convert("RGB")


def film() -> list[Image.Image]:
    """A frame after each action."""
    frames: list[Image.Image] = []
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "files"
        folder.mkdir()
        with opened(Path(place) / "profile") as browser, served(folder, "", PATIENCE) as server:
            page = browser.page(server.address, width=WIDTH, height=HEIGHT)
            page.wait("document.querySelectorAll('#open option').length > 20")
            choose(page, {"new": True})
            page.wait("document.body.classList.contains('draft')")
            person = Person(page, lambda: frames.append(frame(page)))
            person.judge()
            page.wait(EXACT)
            person.press("v")
    return frames


def write(path: Path) -> None:
    """The animation; frames that show nothing new are left out."""
    frames = film()
    # One palette, so that a colour stays what it is: that of the last frame with all that is drawn before.
    sheet = Image.new("RGB", (frames[0].width, 3 * frames[0].height))
    for k, part in enumerate((0, len(frames) // 2, -1)):
        sheet.paste(frames[part], (0, k * frames[0].height))
    # Lines are few dots, whose colours count as well.
    palette = sheet.quantize(COLOURS, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    shades = [one.quantize(palette=palette, dither=Image.Dither.NONE) for one in frames]
    kept = [one for k, one in enumerate(shades) if k == 0 or one.tobytes() != shades[k - 1].tobytes()]
    times = [SHOWN] * (len(kept) - 1) + [LAST]
    kept[0].save(path, save_all=True, append_images=kept[1:], duration=times, loop=0, optimize=True)


if __name__ == "__main__":
    write(Path(sys.argv[1]))
