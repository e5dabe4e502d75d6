"""The bundled examples: each is sound, answers all four questions, and can be written with changed values."""

from importlib import resources

import numpy as np
import pytest

from helpers.answers import EXAMPLES
from jointplay import _core, examples
from jointplay.analyses.nominal import nominal
from jointplay.errors import InputError
from jointplay.model.mechanism import Mechanism, loads
from jointplay.model.mobility import examine, require_determinate

OK, UNDETERMINED = (_core.STATUSES.index(status) for status in ("ok", "undetermined"))


def mechanism(name: str) -> Mechanism:
    return loads(examples.text(name), f"{name}.toml")


def test_every_file_is_listed() -> None:
    files = {entry.name for entry in resources.files(examples).iterdir() if entry.name.endswith(".toml")}
    assert files == {f"{name}.toml" for name in examples.names() if not examples.parameters(name)}


@pytest.mark.parametrize("name", EXAMPLES)
class TestExample:
    def test_it_is_sound(self, name: str) -> None:
        m = mechanism(name)
        assert m.title == examples.title(name)
        assert m.has_loads
        require_determinate(m)
        assert examine(m).assembled

    def test_it_answers_all_questions(self, name: str) -> None:
        m = mechanism(name)
        path = nominal(m)
        assert (path.status == OK).all()
        for answer in (
            m.core.loaded(path.drives, path.poses),
            m.core.worst(path.drives, path.poses, starts=4),
            m.core.random(path.drives, path.poses, 200, 1, np.array([0.5])),
        ):
            assert np.isin(answer["status"], (OK, UNDETERMINED)).all()

    def test_it_stays_well_away_from_singularities(self, name: str) -> None:
        m = mechanism(name)
        path = nominal(m)
        assert (m.core.measure(path.drives, path.poses)["singular_value"] > 0.02).all()

    def test_its_comments_survive_a_setting(self, name: str) -> None:
        before, after = examples.text(name), examples.text(name, {"title": '"My own"'})
        comments = [[line for line in text.splitlines() if "#" in line] for text in (before, after)]
        assert comments[0] == comments[1]
        assert loads(after).title == "My own"


def test_settings_are_toml_or_else_text() -> None:
    text = examples.text(
        "four-bar",
        {
            "joints.*.clearance.radial": "0.2",
            "drives.theta1.values": "[30, 40]",
            "loads.0.force": "[5, 5]",
            "limits.position": "0.5",
            "units.length": "cm",
            "title": "Mine [1]",
        },
    )
    m = loads(text)
    assert m.value("joints.*.clearance.radial") == 0.2
    assert m.value("drives.theta1.values") == [30, 40]
    assert m.value("loads.0.force") == [5, 5]
    assert m.limits.errors["position"][1] == pytest.approx(0.005)
    assert (m.title, m.units.length_name) == ("Mine [1]", "cm")


def test_a_setting_replaces_its_other_way_of_writing() -> None:
    assert loads(examples.text("p3r", {"drives.v.values": "[100]"})).value("drives.v") == {
        "joint": "P",
        "values": [100],
    }


def test_a_setting_can_bring_a_table() -> None:
    m = loads(examples.text("p3r", {"joints.P.clearance.gap": "0.05", "joints.P.clearance.length": "60"}))
    assert m.sources == ("J1", "P", "J2", "J3")


@pytest.mark.parametrize(
    ("name", "settings", "said"),
    [
        ("fourbar", {}, "'fourbar' is not an example; did you mean 'four-bar'? Known: four-bar, p3r"),
        (
            "four-bar",
            {"joints.J1.clearance.radial": "-1"},
            "four-bar.toml: joints.J1.clearance.radial: must not be neg",
        ),
        ("four-bar", {"joints.J9.clearance.radial": "1"}, "'J9' is not a joint; known: J1, J2, J3, J4"),
        ("four-bar", {"joints.*.clearance.gap": "1"}, "the * matches nothing"),
        ("four-bar", {"units.length": "inch"}, 'units.length: "inch" is not valid here'),
        ("four-bar", {"drives.theta1.values": "[1, 2"}, "drives.theta1.values: a list in brackets is needed"),
        ("four-bar", {"loads.0.moment": "1\nforce = 2"}, "loads.0.moment: a number is needed"),
        ("four-bar", {"format.x": "1"}, "format is 1 and has no 'x' below it"),
        ("3-upu", {"base_radus": "1"}, "did you mean 'base_radius'? Known: base_radius, platform_radius, height"),
        ("3-upu", {"layout": "delta"}, "3-upu: layout: 'delta' is not known here; known: tsai, snu"),
        ("3-upu", {"height": "0"}, "3-upu: height: a number, more than 0, is needed, not 0"),
        ("3-upu", {"radial": "-1"}, "3-upu: radial: a number, 0 or more, is needed, not -1"),
        ("3-upu", {"joints.base9.clearance.radial": "1"}, "'base9' is not a joint"),
        ("stewart-gough", {"base_spread": "120"}, "stewart-gough: base_spread: the pairs are 120 deg apart"),
        ("delta", {"height": "900"}, "delta: height: arm and rod cannot reach the platform, 905.5"),
    ],
)
def test_a_wrong_setting_is_refused(name: str, settings: dict[str, str], said: str) -> None:
    with pytest.raises(InputError) as caught:
        examples.text(name, settings)
    assert said in str(caught.value)


def test_the_published_strokes_and_angles() -> None:
    """Both mechanisms of Jaiswal et al. carry the pin B through the same eleven positions, to their rounding."""
    four_bar, p3r = mechanism("four-bar"), mechanism("p3r")
    np.testing.assert_allclose(p3r.value("drives.v.from") + 4.5 * np.arange(11), np.linspace(90, 135, 11))
    apart = nominal(four_bar).output - nominal(p3r).output
    assert np.abs(apart[:, :2]).max() < 0.03e-3
