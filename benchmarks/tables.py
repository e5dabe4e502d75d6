"""Reports as Markdown, and their place in the documentation."""

import platform
import re
import subprocess
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

from harness import CORES, Report, number

PAGE = Path(__file__).parent.parent / "docs" / "benchmarks.md"
PEERS = ("jointplay", "numpy", "scipy", "numba", "jax", "casadi", "pylinkage", "pin", "cvxpy")


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table; all columns read from the left."""
    head, *body = (f"| {' | '.join(line)} |" for line in [header, *rows])
    return "\n".join([head, "|---" * len(header) + "|", *body])


def written(report: Report) -> str:
    """One workload: what it measured, and which targets this run reaches."""
    targets = [
        [
            t.what,
            f"{'at most' if t.at_most else 'at least'} {number(t.asked)}",
            number(t.measured),
            t.verdict,
        ]
        for t in report.targets
    ]
    parts = [table(report.header, report.rows)]
    if targets:
        parts.append(table(["ratio", "target", "measured", "in this run"], targets))
    return f"### {report.name}: {report.title}\n\n" + "\n\n".join([*parts, *report.notes]) + "\n"


def machine() -> str:
    """Processor, system, compiler and versions."""
    info = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    model = re.search(r"^model name\s*: (.*)$", info, re.MULTILINE)
    flags = re.search(r"^flags\s*: (.*)$", info, re.MULTILINE)
    widest = next((f for f in ("avx512f", "avx2") if flags and f in flags[1].split()), "no AVX2")
    compiler = subprocess.run(["cc", "--version"], check=True, capture_output=True, text=True).stdout.splitlines()[0]
    rust = subprocess.run(["rustc", "--version"], check=True, capture_output=True, text=True).stdout.strip()
    rows = [
        ["processor", f"{model[1] if model else platform.processor()}, {len(CORES)} cores, {widest}"],
        ["system", f"{platform.system()} {platform.machine()}, Python {platform.python_version()}"],
        ["compilers", f"{rust}; {compiler}"],
        ["versions", ", ".join(f"{name} {version(name)}" for name in PEERS)],
    ]
    return table(["", ""], rows)


def replace(page: str, name: str, text: str) -> str:
    """Put text between the marks that carry a name."""
    begin, end = f"<!-- {name}: written by benchmarks/run.py -->", f"<!-- end of {name} -->"
    pattern = re.compile(f"{re.escape(begin)}.*?{re.escape(end)}", re.DOTALL)
    if not pattern.search(page):
        raise ValueError(f"{PAGE.name} has no place for {name}")
    return pattern.sub(lambda _: f"{begin}\n\n{text.strip()}\n\n{end}", page)


def write_page(reports: Sequence[Report]) -> None:
    """Write all tables into the page."""
    page = replace(PAGE.read_text(encoding="utf-8"), "machine", machine())
    for report in reports:
        page = replace(page, report.name, written(report).partition("\n")[2])
    PAGE.write_text(page, encoding="utf-8")
