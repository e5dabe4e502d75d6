"""Compile the mechanisms of the core's own benchmarks: the bundled ones, the four-bar of W1 and the ten-bar of W2."""

import json
from pathlib import Path

import jointplay as jp
from jointplay import examples

HERE = Path(__file__).parent
BUILD = HERE.parent / "build" / "benchmarks"


def main() -> None:
    """Write them all into one file."""
    mechanisms = {name: jp.loads(examples.text(name)) for name in examples.names()}
    mechanisms |= {"W1": jp.load(str(HERE / "four-bar.toml")), "W2": jp.load(str(HERE / "ten-bar.toml"))}
    subjects = [
        {"name": name, "spec": m.spec(), "drives": m.drive_values.tolist()}
        for name, m in mechanisms.items()
        if m.drive_values is not None
    ]
    BUILD.mkdir(parents=True, exist_ok=True)
    (BUILD / "specs.json").write_text(json.dumps(subjects), encoding="utf-8")


if __name__ == "__main__":
    main()
