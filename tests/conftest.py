"""How much of the tests a run has: what fits into a time for every test function, as measured in tests/times.txt."""

import math
from collections import Counter, defaultdict
from pathlib import Path

import pytest

#: seconds of one case of a test function; functions that are not in it are quick
TIMES = Path(__file__).parent / "times.txt"
#: seconds from which on a function has a line in there, if it has one case, and if it may have many
SHORT = {False: 0.5, True: 0.05}
#: A single case may take this many times what its function has.
SINGLE = 8


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("jointplay")
    group.addoption(
        "--budget",
        type=float,
        default=3.0,
        metavar="SECONDS",
        help="what each test function may take, as tests/times.txt has it: as many of its cases as fit, evenly spread, "
        f"at least one, and none if one takes {SINGLE} times as long; inf for all. What is named with :: runs whole.",
    )
    group.addoption("--measure", action="store_true", help="write what cases of this run took to tests/times.txt")


def pytest_configure(config: pytest.Config) -> None:
    if config.getoption("measure") and not hasattr(config, "workerinput"):
        config.pluginmanager.register(Measuring())


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    budget = config.getoption("budget")
    if any("::" in argument for argument in config.args):
        return
    functions: defaultdict[str, list[pytest.Item]] = defaultdict(list)
    for item in items:
        functions[function_of(item.nodeid)].append(item)
    seconds = measured()
    left_out = set[pytest.Item]()
    for name, cases in functions.items():
        if cases[0].get_closest_marker("whole") is None:
            left_out.update({*cases} - {*within(cases, seconds[name], budget)})
    if left_out:
        config.hook.pytest_deselected(items=[item for item in items if item in left_out])
        items[:] = [item for item in items if item not in left_out]


def function_of(nodeid: str) -> str:
    return nodeid.partition("[")[0]


def measured() -> Counter[str]:
    lines = (line.split(maxsplit=1) for line in TIMES.read_text(encoding="utf-8").splitlines())
    return Counter({name: float(seconds) for seconds, name in lines})


def within(cases: list[pytest.Item], seconds: float, budget: float) -> list[pytest.Item]:
    """Cases that fit into a time, evenly spread over all."""
    if len(cases) * seconds <= budget:
        return cases
    few = max(math.floor(budget / seconds), int(seconds <= SINGLE * budget))
    return [cases[(2 * k + 1) * len(cases) // (2 * few)] for k in range(few)]


class Measuring:
    """Collects the times of a run; functions that were not run keep theirs."""

    def __init__(self) -> None:
        self.seconds = Counter[str]()
        self.cases: defaultdict[str, set[str]] = defaultdict(set)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        name = function_of(report.nodeid)
        self.seconds[name] += report.duration
        self.cases[name].add(report.nodeid)

    def pytest_sessionfinish(self) -> None:
        found = dict(measured())
        for name, cases in self.cases.items():
            found[name] = self.seconds[name] / len(cases)
            if found[name] < SHORT[any("[" in case for case in cases)]:
                del found[name]
        TIMES.write_text(
            "".join(f"{seconds:.2f} {name}\n" for name, seconds in sorted(found.items())), encoding="utf-8"
        )
