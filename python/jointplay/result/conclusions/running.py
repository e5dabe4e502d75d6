"""The machine as it runs: at which speeds an answer holds, what it leaves out, and where contact may be lost."""

from collections.abc import Iterator

import numpy as np

from jointplay.result import Result
from jointplay.result.verdict import LOOSE, there

from .words import Sentence, plural

#: contact rates above which the number says nothing more
THROUGH = 100.0


def of_running(result: Result) -> Iterator[Sentence]:
    """What is said of a result with speeds; nothing of one at rest."""
    if "speeds" not in result.attrs:
        return
    yield from _of_contact(result)
    yield from of_speeds(result)
    if "rounded" in result.attrs:
        yield Sentence(
            f"Accelerations are uncertain: {result.attrs['rounded']}. Give the values of the table more digits."
        )


def of_speeds(result: Result) -> Iterator[Sentence]:
    """At which speeds the loads act, and what is left out of it; nothing of a result at rest."""
    speeds = result.attrs.get("speeds")
    if speeds is None:
        return
    counted = "inertia acts at the nominal motion; impacts and vibrations are left out"
    if result.attrs["inertia"] == "none":
        counted = "no body has a mass, so that speed changes nothing"
    elif not {"contact_rate", "contact_loaded"} & {*result.data}:
        counted += "; whether contact follows is not judged "
        counted += "in over-constrained and elastic mechanisms"
    yield Sentence(f"Quasi-static at {speeds}: {counted}.", is_common=True)


def _of_contact(result: Result) -> Iterator[Sentence]:
    if "contact_rate" not in result.data:
        return
    rates = result.get("contact_rate")
    if not rates.ndim:  # said where sizes are judged
        return
    names = result.labels("source")
    judged = np.isfinite(rates) | np.isinf(rates)
    if not judged.any():
        return
    safe = np.where(judged, rates, -1.0)
    states = result.get("contact")
    for state in LOOSE:
        places = np.flatnonzero((states == state).any(axis=0))
        if not len(places):
            continue
        top = max(places.tolist(), key=lambda s: float(safe[:, s].max()))
        k = int(safe[:, top].argmax())
        those = names[top] if len(places) == 1 else f"{names[top]} and {plural(len(places) - 1, 'other')}"
        verb, other = ("is lost", "is") if state == "lost" else ("may be lost", "may be")
        rate, crossing = float(safe[k, top]), float(result.get("transit_time")[k, top])
        why = "the reaction goes through zero" if rate > THROUGH else f"contact rate {rate:.2g}"
        share = ""
        if "time" in result.data and (whole := float(result.get("time")[-1])) > 0.0:
            share = f", {100.0 * crossing / whole:.2g} % of the path,"
        text = f"Contact {verb} in {those}: {why}{there(result, k).replace(' at ', ' near ', 1)}"
        yield Sentence(
            f"{text}; for {1e3 * crossing:.2g} ms or more{share} the offset there {other} another one.", is_alarm=True
        )
        return
    most = safe.max(axis=0)
    who = int(most.argmax())
    yield Sentence(f"Contact follows the reactions: contact rate at most {float(most[who]):.2g}, in {names[who]}.")


def loose(result: Result) -> str:
    """``may be lost in main near configuration 18 (contact rate 1.2)`` of an answer about sizes, if it may be."""
    if "contact_source" not in result.data or str(result.get("contact")) not in LOOSE:
        return ""
    rate, place = float(result.get("contact_rate")), int(result.get("contact_configuration"))
    how = "the reaction goes through zero" if rate > THROUGH else f"contact rate {rate:.2g}"
    state = "is lost" if str(result.get("contact")) == "lost" else "may be lost"
    return f"{state} in {result.get('contact_source')} near configuration {place} ({how})"
