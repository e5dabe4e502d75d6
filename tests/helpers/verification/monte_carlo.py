"""Specimens of planar linkages, drawn and closed without jointplay."""

from typing import Any

import numpy as np

from helpers.oracles import statistics
from helpers.oracles.core_spec import MM
from helpers.oracles.linkage import Linkage

from .planar import IN_MM, is_rigid
from .subject import Array, Check, Found, Subject

SAMPLES = 4000
LAWS = ("uniform", "boundary", "normal")


def deviations(s: Subject) -> Found:
    """Standard deviations of the components, in their standard errors."""
    k = s.count // 2
    link, q, drives = s.linkage(k)
    u = _specimens(s, link, np.random.default_rng(3))
    poses, closes = link.solve(np.broadcast_to(q, (SAMPLES, q.size)), drives, u)
    assert closes.all()
    theirs = link.out(poses, u).std(axis=0, ddof=1) / IN_MM
    found = s.core.random(*s.one(k), 4 * SAMPLES, 1, np.array([0.5]))
    ours = np.sqrt(np.diagonal(found["covariance"][0]))
    moves = ours > 1e-9 * np.array([s.size, s.size, 1.0])
    error = np.hypot(found["std_standard_error"][0], theirs / np.sqrt(2 * SAMPLES))
    return Found.of(ours[moves], theirs[moves], error[moves])


def _specimens(s: Subject, link: Linkage, rng: np.random.Generator) -> Array:
    """Offsets of specimens by the laws of the sources, sizes of parts first."""
    growth: dict[int, Any] = {}
    for source in s.spec["sources"]:
        if source["kind"] == "size":
            drawn = _number(source["set"]["interval"], source["law"], rng)
            for part in (source, *source.get("also", [])):
                growth[part["joint"]] = growth.get(part["joint"], 0.0) + MM * part["factor"] * drawn
    laws = {f"j{x['joint']}": x["law"] for x in s.spec["sources"] if x["kind"] == "clearance"}
    laws |= {f"s{i}": x["law"] for i, x in enumerate(s.spec["sources"])}
    laws |= {f"d{x['drive']}": x["law"] for x in s.spec["sources"] if x["kind"] == "drive"}
    laws |= {f"j{x['joint']}": x["law"] for x in s.spec["sources"] if x["kind"] == "angle"}
    found = []
    for of in link.sources:
        law = laws[of.name]
        if of.kind == "interval":
            low, high = of.size
            found.append(_number({"low": low, "high": high}, law, rng)[:, None] + np.array(of.centre))
            continue
        wider = 1.0 + growth.get(int(of.name[1:]), 0.0) / of.size[0] * np.ones(SAMPLES)
        if of.kind == "disc":
            shift = statistics.disc(rng, of.size[0], law, SAMPLES)
            values = np.stack([shift.real, shift.imag], axis=-1)
        else:
            values = of.sample(rng, SAMPLES, boundary=False)
        found.append(values * np.maximum(wider, 0.0)[:, None])
    return np.concatenate(found, axis=-1)


def _number(bounds: dict[str, float], law: str, rng: np.random.Generator) -> Array:
    """A number by its law; a normal one has its limits at three standard deviations and is drawn again beyond them."""
    low, high = bounds["low"], bounds["high"]
    if law == "uniform":
        return rng.uniform(low, high, SAMPLES)
    drawn = rng.normal(size=2 * SAMPLES)
    drawn = drawn[np.abs(drawn) < statistics.K][:SAMPLES]
    return 0.5 * (low + high) + 0.5 * (high - low) / statistics.K * drawn


def _scatters_simply(s: Subject) -> bool:
    sets = {(next(iter(x["set"])), x["law"]) for x in s.spec["sources"]}
    plain = {("disc", law) for law in LAWS} | {("diamond", "uniform"), ("interval", "uniform"), ("interval", "normal")}
    return is_rigid(s) and sets <= plain


CHECKS = [
    Check(
        "standard deviation",
        "plain Monte Carlo",
        ("numpy",),
        "standard errors",
        5.0,
        "five standard errors of the two samples",
        _scatters_simply,
        deviations,
    ),
]
