"""Pictures, one after the other, as a file: a page with a slider, a GIF, or a film made by ffmpeg."""

import base64
import io
import os
import shutil
import subprocess
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from html import escape
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from jointplay.basics import pages
from jointplay.errors import InputError, one_line

#: dots of a picture, (height, width, red green blue)
Picture = NDArray[np.uint8]
TOOL = "ffmpeg"
#: colours of a picture in a page or a GIF
PALETTE = 128

STYLE = """
body {{ margin: 0 auto; max-width: {width}px; padding: 8px; font: 14px sans-serif; background: {paper}; color: {ink} }}
img {{ width: 100%; display: block }} div {{ display: flex; gap: 8px; align-items: center }} input {{ flex: 1 }}
"""
BODY = """<body>
<img id="picture" alt="{title}">
<div><button id="play" type="button">Pause</button>
<input id="slider" type="range" min="0" max="{last}" value="0" aria-label="frame"></div>
<script>
const frames = [{frames}], picture = document.getElementById("picture");
const slider = document.getElementById("slider"), play = document.getElementById("play");
let timer = null;
function show(k) {{ picture.src = "data:image/png;base64," + frames[k]; slider.value = k; }}
function go(on) {{
  clearInterval(timer); timer = null; play.textContent = on ? "Pause" : "Play";
  if (on) timer = setInterval(() => show((Number(slider.value) + 1) % frames.length), {pause});
}}
slider.oninput = () => {{ go(false); show(Number(slider.value)); }};
play.onclick = () => go(timer === null);
show(0); go(!matchMedia("(prefers-reduced-motion: reduce)").matches);
</script></body></html>
"""


def check_tool(path: Path) -> None:
    """Refuse a film where there is no ffmpeg.

    Raises
    ------
    InputError
    """
    if path.suffix.lower() == ".mp4" and shutil.which(TOOL) is None:
        problem = "an .mp4 needs ffmpeg, which is not found: install it (https://ffmpeg.org), or write .html or .gif"
        raise InputError(problem, file=os.fspath(path))


def _reduced(picture: Picture) -> Image.Image:
    return Image.fromarray(picture).quantize(PALETTE, dither=Image.Dither.NONE)


def gif(pictures: Iterable[Picture], fps: int, path: Path, title: str) -> None:
    """A GIF that repeats."""
    first, *rest = map(_reduced, pictures)
    comment = one_line(title).encode()
    pause = round(1000 / fps)
    first.save(path, "GIF", save_all=True, append_images=rest, duration=pause, loop=0, comment=comment)


def page(pictures: Iterable[Picture], fps: int, path: Path, title: str) -> None:
    """A page that carries all pictures, with a slider through them; it needs no network."""
    frames = []
    width, paper = 0, "#ffffff"
    for picture in pictures:
        content = io.BytesIO()
        _reduced(picture).save(content, "PNG", optimize=True)
        frames.append(f'"{base64.b64encode(content.getvalue()).decode()}"')
        width, paper = picture.shape[1], "#{:02x}{:02x}{:02x}".format(*picture[0, 0])
    ink = "#000000" if int(paper[1:3], 16) > 127 else "#e8e8e8"
    style = STYLE.format(width=width, paper=paper, ink=ink)
    shown: dict[str, Any] = {"title": escape(one_line(title)), "last": len(frames) - 1, "pause": round(1000 / fps)}
    text = pages.head(title, style) + BODY.format(**shown, frames=",".join(frames))
    path.write_text(text, encoding="utf-8")


def film(pictures: Iterable[Picture], fps: int, path: Path, title: str) -> None:
    """A film in H.264; what ffmpeg says is reported if it fails.

    Raises
    ------
    InputError
    """
    steps = iter(pictures)
    first = _even(next(steps))
    command = [
        TOOL, "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24",
        "-s", f"{first.shape[1]}x{first.shape[0]}", "-r", str(fps), "-i", "-", "-an", "-c:v", "libx264",
        "-pix_fmt", "yuv420p", "-metadata", f"title={one_line(title)}", "-movflags", "+faststart", "-f", "mp4",
        os.fspath(path),
    ]  # fmt: skip
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        try:
            said = _fed(process, chain([first], map(_even, steps)))
        except BaseException:
            process.kill()
            raise
    if process.returncode != 0:
        last = (said.decode(errors="replace").strip().splitlines() or ["no reason given"])[-1]
        raise InputError(f"ffmpeg could not write it: {last}", file=os.fspath(path.name))


def _fed(process: subprocess.Popen[bytes], pictures: Iterator[Picture]) -> bytes:
    """Hand over the pictures; what the program says."""
    assert process.stdin is not None
    # A program that has stopped says why, below.
    with suppress(BrokenPipeError):
        for picture in pictures:
            process.stdin.write(picture.tobytes())
    return process.communicate()[1]


def _even(picture: Picture) -> Picture:
    """With an even number of dots along both sides, as the coding of colours needs it."""
    height, width = (side - side % 2 for side in picture.shape[:2])
    return picture[:height, :width]


MOVIES: dict[str, Callable[[Iterable[Picture], int, Path, str], None]] = {".mp4": film, ".gif": gif, ".html": page}
