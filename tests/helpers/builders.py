"""Mechanisms that tests write down: builders whose units are mm, degrees and N where a test names no others."""

from typing import Any

import jointplay as jp


def planar(*, length: str = "mm", angle: str = "deg", force: str = "N", **head: Any) -> jp.Builder:
    """A builder in the plane."""
    return _builder("planar", {"length": length, "angle": angle, "force": force}, head)


def spatial(*, length: str = "mm", angle: str = "deg", force: str = "N", **head: Any) -> jp.Builder:
    """A builder in space."""
    return _builder("spatial", {"length": length, "angle": angle, "force": force}, head)


def _builder(space: Any, units: Any, head: dict[str, Any]) -> jp.Builder:
    if "turning_speed" in head:
        units |= {"turning_speed": head.pop("turning_speed")}
    return jp.Builder(space=space, units=units, **head)
