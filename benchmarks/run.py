"""Measure jointplay side by side with other ways to the same numbers; write the tables into the documentation.

python benchmarks/run.py                    everything, and the tables into docs/benchmarks.md
python benchmarks/run.py --only W1 W6       some workloads, printed only
python benchmarks/run.py --quick            few rounds, printed only
"""

import argparse
import importlib
import json
import os
import subprocess
import sys
from dataclasses import asdict

from harness import Report, Target, tie
from tables import write_page, written

WORKLOADS = {
    "W1": "w1_fourbar",
    "W2": "w2_tenbar",
    "W3": "w3_map",
    "W4": "w4_upu",
    "W5": "w5_chain",
    "W6": "w6_start",
    "W7": "w7_cones",
    "W8": "w8_calls",
    "W9": "w9_points",
    "W10": "w10_tails",
    "W11": "w11_allocation",
    "W12": "w12_arm",
    "felt": "felt",
    "phases": "phases",  # after `make bench-core`
}
#: set before anything numerical is imported
THREADS = {
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "NUMBA_NUM_THREADS": "1",
    "RAYON_NUM_THREADS": "2",  # on one core unless a workload allows it two
    "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1",
    "JAX_PLATFORMS": "cpu",
    "JAX_ENABLE_X64": "1",
}


def measured(name: str, rounds: int) -> Report:
    """Measure one workload in a process of its own."""
    call = [sys.executable, __file__, "--rounds", str(rounds), "--child", name]
    answer = subprocess.run(call, env=os.environ | THREADS, check=True, stdout=subprocess.PIPE, text=True).stdout
    found = json.loads(answer.splitlines()[-1])
    return Report(**{**found, "targets": [Target(**t) for t in found["targets"]]})


def main() -> None:
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=WORKLOADS, default=list(WORKLOADS), help="workloads")
    parser.add_argument("--rounds", type=int, default=9, help="interleaved rounds")
    parser.add_argument("--quick", action="store_true", help="two rounds")
    parser.add_argument("--child", choices=WORKLOADS, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.child:
        tie(1)
        report = importlib.import_module(WORKLOADS[options.child]).measure(options.rounds)
        print(json.dumps(asdict(report)))
        return
    reports = []
    for name in options.only:
        reports.append(measured(name, 2 if options.quick else options.rounds))
        print(written(reports[-1]), flush=True)
    if not options.quick and options.only == list(WORKLOADS):
        write_page(reports)


if __name__ == "__main__":
    main()
