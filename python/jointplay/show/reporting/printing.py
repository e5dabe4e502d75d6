"""Pages as PDF, by a browser that is installed."""

import shutil
import subprocess
import tempfile
from pathlib import Path

from jointplay.errors import JointplayError

#: names that Chromium and browsers like it go by
BROWSERS = (
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "chrome",
    "microsoft-edge",
    "msedge",
)
#: seconds within which a page is printed
PATIENCE = 120


def browser() -> str:
    """The program that prints.

    Raises
    ------
    JointplayError
        When none is found.
    """
    for name in BROWSERS:
        if found := shutil.which(name):
            return found
    raise JointplayError("a report as .pdf needs Chromium, Chrome or Edge, and none is found; write .html and print it")


def pdf(page: str) -> bytes:
    """A page as PDF.

    Raises
    ------
    JointplayError
        When the browser does not print it.
    """
    program = browser()
    with tempfile.TemporaryDirectory(prefix="jointplay-") as folder:
        source, target = Path(folder, "page.html"), Path(folder, "page.pdf")
        source.write_text(page, encoding="utf-8")
        # A profile of its own: an open window of the same browser would take the page over.
        options = ["--headless", "--disable-gpu", "--no-pdf-header-footer", f"--user-data-dir={folder}/profile"]
        # The page asks for no network and comes from here; in containers a browser has no sandbox.
        command = [program, *options, "--no-sandbox", f"--print-to-pdf={target}", source.as_uri()]
        try:
            done = subprocess.run(command, capture_output=True, timeout=PATIENCE, check=False)
        except (OSError, subprocess.TimeoutExpired) as problem:
            raise JointplayError(f"{program} does not print the page: {problem}") from None
        if not target.is_file():
            said = done.stderr.decode(errors="replace").strip().splitlines()
            raise JointplayError(f"{program} does not print the page: {said[-1] if said else 'no reason given'}")
        return target.read_bytes()
