"""The answers about what is built: `check` and `assemble`."""

from collections.abc import Iterator

import numpy as np

from jointplay.result import Result, rounding, size, typical

from .words import Conclusion, Sentence, plural, say

#: what comes of a step, in words
VERDICTS = {
    "ok": "fits",
    "undetermined": "fits, with play",
    "underconstrained": "fits, has to be held",
    "strained": "fits under strain",
    "not_assemblable": "does not fit",
    "singular": "singular",
    "not_assembled": "cannot be closed",
}
#: steps after which nothing has to be forced
FITS = ("ok", "undetermined", "underconstrained")
#: force in the unit of the file that is rounding
NO_FORCE = 1e-6


def of_check(result: Result) -> Conclusion:
    """Whether it can be assembled and moves as the drives say."""
    assembled, decided = (bool(result.attrs[name]) for name in ("assembled", "decided"))
    failed = str(result.attrs.get("misfit", "it cannot be assembled" if "failure" in result.attrs else ""))
    if assembled:
        whether = "It can be assembled near its start"
    else:
        whether = failed[:1].upper() + failed[1:] if failed else "It cannot be assembled near its start"
    mobility = str(result.attrs["mobility"])
    also = f": {mobility}" if assembled and decided else ""
    sentences = [Sentence(f"{whether}{also}.", is_alarm=not assembled)]
    if not also:
        sentences.append(Sentence(f"{mobility[0].upper()}{mobility[1:]}.", is_alarm=not decided))
    count = int(result.attrs["configurations"])
    has = [plural(result.sizes.get("source", 0), "source of error", "sources of error")]
    has.append(plural(count, "configuration"))
    limits = str(result.attrs.get("limits", "")).splitlines()
    judged = f"; limits: {'; '.join(limits)}" if limits else "; no [limits]"
    sentences.append(Sentence(f"It has {', '.join(has)}{judged}."))
    return Conclusion((*sentences, *_interferences(result)))


def _interferences(result: Result) -> Iterator[Sentence]:
    """Which joints have interference instead of play, in all specimens or in some, and what they are taken as."""
    if "play" not in result.data:
        return
    play, unit = result.get("play"), result.unit("play")
    given = result.get("play_given").tolist()
    for name, fit, (low, high) in zip(result.labels("clearance"), given, play.tolist(), strict=True):
        if high <= 0.0 and low < 0.0:
            span = f"{say(abs(high), unit)} to {say(-low, unit)}"
            text = f"{name}, {fit}, always has interference, {span}: what is pressed in does not turn or slide;"
            yield Sentence(f"{text} here it is taken as a joint without play.", is_alarm=True)
        elif low < 0.0:
            span = f"from {say(-low, unit)} interference to {say(high, unit)} play"
            yield Sentence(f"{name}, {fit}, goes {span}; specimens with interference are taken as joints without play.")


def of_assemble(result: Result) -> Conclusion:
    """Whether every step fits, and how far off the output is in the end."""
    steps = result.labels("step")
    if "probability_of_fit" in result.data:
        shares = np.nan_to_num(result.get("probability_of_fit"))
        k = int(shares.argmin())
        if shares[k] >= 1.0:
            fits = Sentence(f"All {plural(len(steps), 'step')} fit without strain in every specimen.")
        else:
            text = (
                f"Step {steps[k]}, {_what(result, k)}, fits without strain in {100 * shares[k]:.4g} % of the specimens"
            )
            fits = Sentence(f"{text}; in the other steps more do." if len(steps) > 1 else f"{text}.")
        return Conclusion((fits, *_force(result, result.data.get("quantile_force") is not None), *_end(result)))
    statuses = result.get("status").tolist()
    bad = [k for k, status in enumerate(statuses) if status not in FITS]
    if bad:
        k = bad[0]
        more = f", and {plural(len(bad) - 1, 'step')} after it" if len(bad) > 1 else ""
        text = f"Step {steps[k]} of {len(steps)}, {_what(result, k)}, {VERDICTS[statuses[k]]}{more}."
        fits = Sentence(text, is_alarm=True)
    else:
        loose = len(statuses) - statuses.count("ok")
        play = f"; after {loose} of them something has play or has to be held" if loose else ""
        fits = Sentence(f"All {plural(len(steps), 'step')} fit{play}.")
    return Conclusion((fits, *_force(result, "kind" in result.data), *_end(result)))


def _what(result: Result, k: int) -> str:
    links = result.get("links" if "links" in result.data else "members")[k]
    return f"to add {links}"


def _force(result: Result, is_known: bool) -> list[Sentence]:
    """The largest force of a member on the way."""
    names = [name for name in ("member_force", "worst_force", "quantile_force") if name in result.data]
    if not is_known or not names:
        return []
    at = {"probability": typical(result)} if names[0] == "quantile_force" else {}
    forces = np.abs(np.nan_to_num(result.get(names[0], **at)))
    if not forces.size or forces.max() <= NO_FORCE:
        return []
    k, member = np.unravel_index(int(forces.argmax()), forces.shape)
    unit, step = result.data[names[0]].units, result.labels("step")[k]
    share = f", in {100 * at['probability']:g} % of the specimens at most" if at else ""
    where = f"{result.labels('member')[member]}, step {step}"
    return [Sentence(f"Largest force{share}: {say(forces[k, member], unit)} in {where}.")]


def _end(result: Result) -> list[Sentence]:
    """How far off the output is after the last step."""
    if "kind" not in result.data:
        return []
    share = ""
    if "worst_position" in result.data:
        value, most, unit = result.get("worst_position")[-1], "at most ", result.data["worst_position"].units
    elif "quantile_position" in result.data:
        level = typical(result)
        value, most = result.get("quantile_position", probability=level)[-1], "at most "
        unit = result.data["quantile_position"].units
        share = f", in {100 * level:g} % of the specimens"
    else:
        value, most = size(result, "error", "position")[-1], ""
        unit = result.unit("error", component=result.labels("component")[0])
    if not np.isfinite(value):
        return []
    shown = 0.0 if value <= rounding(result, unit) else float(value)
    return [Sentence(f"In the end the output is off by {most}{say(shown, unit)}{share}.")]
