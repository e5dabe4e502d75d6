"""The report of every bundled example: whole, without a request, and with the numbers of the questions.

`python tests/verify_reports.py [NAME ...]` writes the reports of all examples, or of those that are named, opens them
in a browser and compares their numbers with those of the questions. It prints a line for each and ends with 1 where
anything is wrong. It takes some minutes; `test_report.py` does the same for some of them.
"""

import base64
import html
import io
import json
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

import jointplay as jp
from helpers.cores import on_all_cores
from jointplay import examples
from jointplay.result import from_dataset, parts, size
from jointplay.show.reporting.answers import directions
from jointplay.show.reporting.printing import BROWSERS

BROWSER = next(filter(None, map(shutil.which, BROWSERS)), None)
#: few specimens: only whether they stand on the page is looked at
FEW = 256
#: characters that an attachment may have
MOST = 6_000_000
#: elements of a picture that has more in it than its axes
ELEMENTS = 12
#: part of the largest number of a drawing within which its numbers are kept
KEPT = 2e-4
#: put into a copy of a page: says in its body what has become of it
SEEN = """<script>addEventListener("load", () => setTimeout(() => {
  const images = [...document.images];
  document.body.dataset.broken = images.filter((image) => !image.complete || !image.naturalWidth).length;
  document.body.dataset.images = images.length;
  const asked = performance.getEntriesByType("resource").filter((entry) => !entry.name.startsWith("data:"));
  document.body.dataset.requests = asked.length;
}, 300))</script>"""


def written(name: str, folder: Path) -> tuple[jp.Mechanism, Path]:
    """The report of an example."""
    m, path = jp.loads(examples.text(name)), folder / f"{name}.html"
    jp.report(m, path, samples=FEW)
    return m, path


def scenes(text: str) -> list[dict[str, Any]]:
    """The drawings of a page."""
    return [json.loads(part) for part in re.findall(r'<script type="application/json">(.*?)</script>', text, re.DOTALL)]


def files(text: str, name: str) -> list[pd.DataFrame]:
    """The files of numbers with a name, as long frames."""
    found = re.findall(rf'download="{re.escape(name)}" href="[^,]*,([^"]*)"', text)
    return [pd.read_csv(io.BytesIO(base64.b64decode(content))) for content in found]


def column(table: pd.DataFrame, variable: str) -> np.ndarray:
    return table[table.variable == variable].value.to_numpy()


def in_text(m: jp.Mechanism, text: str) -> Iterator[str]:
    """What is wrong with a page as it is written."""
    if len(text) > MOST:
        yield f"{len(text)} characters"
    outside = re.findall(r'(?:src|href)="(?!data:|#)[^"]*"', text)
    if outside or "@import" in text or "url(" in text:
        yield f"refers to something else: {outside}"
    for alt, content in re.findall(r'<img alt="([^"]*)" src="data:image/svg\+xml;base64,([^"]*)"', text):
        picture = base64.b64decode(content).decode()
        if len(re.findall(r"<(?:path|use|image)\b", picture)) < ELEMENTS or re.search(r' d="[^"]*nan', picture):
            yield f"an empty picture: {html.unescape(alt)}"
    drawn = scenes(text)
    if len(drawn) != max(1, len(m.outputs)):
        yield f"{len(drawn)} drawings"
    for k, name in enumerate(m.outputs or (None,)):
        own = m.only(output=name) if name else m
        yield from numbers_of(own, text, drawn[k], k)


def numbers_of(m: jp.Mechanism, text: str, drawn: dict[str, Any], k: int) -> Iterator[str]:
    """Where the numbers of a chapter are not those of the questions."""
    worst = jp.worst(m)
    table = files(text, "worst.csv")[k]
    for variable in ("worst_position", "worst_rotation"):
        if not np.allclose(column(table, variable), worst[variable].values.ravel(), equal_nan=True):
            yield f"{variable} in worst.csv"
    region = jp.region(m.first, directions=directions(m.first))
    extent = column(files(text, "region.csv")[k], "extent")
    if not np.allclose(extent, region.extent.values.ravel()[: len(extent)], equal_nan=True):
        yield "extent in region.csv"
    states = {state["label"]: np.array(state["moves"], dtype=float) for state in drawn["states"]}
    wanted = {"at the largest position error": worst.worst_position.values}
    if m.has_loads:
        loaded = from_dataset(jp.loaded(m))
        errors = column(files(text, "loaded.csv")[k], "error")
        if not np.allclose(errors, loaded.get("error").ravel()[: len(errors)], equal_nan=True):
            yield "error in loaded.csv"
        for heading, part in parts(loaded):
            wanted[", ".join(filter(None, ("under load", heading)))] = size(part, "error", "position")
    if sorted(states) != sorted(wanted):
        yield f"drawn are {sorted(states)}, not {sorted(wanted)}"
        return
    for label, sizes in wanted.items():
        # An output that another body sees moves with it on the drawing.
        moved = np.linalg.norm(states[label][:, drawn["output"]], axis=1)
        is_shown = len(moved) == len(sizes) and not drawn["relative"]
        if is_shown and not np.allclose(moved, sizes, atol=KEPT * np.nanmax(np.abs(states[label])), equal_nan=True):
            yield f"the drawing {label}: {np.nanmax(np.abs(moved - sizes)):g}"


def in_browser(path: Path) -> Iterator[str]:
    """What is wrong with a page as a browser sees it."""
    assert BROWSER is not None
    copy = path.with_name("seen.html")
    copy.write_text(path.read_text(encoding="utf-8") + SEEN, encoding="utf-8")
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr", "--virtual-time-budget=4000"]
    profile = f"--user-data-dir={path.parent / 'profile'}"
    command = [BROWSER, *options, profile, "--dump-dom", copy.as_uri()]
    done = subprocess.run(command, capture_output=True, timeout=120, check=True)
    for line in done.stderr.decode(errors="replace").splitlines():
        if "CONSOLE" in line:
            yield line
    seen = done.stdout.decode()
    (body,) = re.findall(r"<body[^>]*>", seen)
    told = dict(re.findall(r'data-(\w+)="(\d+)"', body))
    if told.get("broken") != "0" or told.get("requests") != "0" or int(told.get("images", 0)) < 5:
        yield f"pictures and requests: {told}"
    for drawing in re.findall(r"<svg viewBox.*?</svg>", seen, re.DOTALL):
        if drawing.count("jp-body") < 1 or 'class="jp-region"' not in drawing or "NaN" in drawing:
            yield "the drawing is not whole"


def looked_at(name: str) -> tuple[float, int, list[str]]:
    """The report of an example: seconds, characters, and what is wrong with it."""
    with tempfile.TemporaryDirectory() as folder:
        begun = time.perf_counter()
        m, path = written(name, Path(folder))
        took = time.perf_counter() - begun
        text = path.read_text(encoding="utf-8")
        found = [*in_text(m, text), *(in_browser(path) if BROWSER else ["no browser is installed"])]
    return took, len(text), found


def main(names: list[str]) -> int:
    """Look at the reports of examples."""
    names, bad = names or list(examples.names()), 0
    for name, (took, length, found) in zip(names, on_all_cores(looked_at, names), strict=True):
        bad += bool(found)
        print(f"{name:22} {took:5.1f} s  {length / 1e6:4.2f} MB  {'; '.join(found) or 'whole'}", flush=True)
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
