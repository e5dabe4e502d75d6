"""What tests repeat over more seeds, mechanisms and sizes than `make test` has time for: all that is marked `long`.

`python tests/verify_long.py [OPTIONS OF PYTEST]`.
"""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

if __name__ == "__main__":
    root = Path(__file__).parents[1]
    sys.exit(pytest.main([f"--rootdir={root}", "-m", "long", "-n", "auto", "--dist", "worksteal", *sys.argv[1:]]))
