"""Files that a mechanism file names are in its folder, also where a link leads: nothing else is read, or shown."""

from pathlib import Path

import pytest

import jointplay as jp
from jointplay.basics.files import beside

SECRET = "a secret of somebody else\n1\n2\n"
#: what names a file, in place of a line of the bundled four-bar, and the key that does
NAMING = {
    "include.0": ("format = 1", 'format = 1\ninclude = ["named"]'),
    "path.csv": ("[drives.theta1]", '[path]\ncsv = "named"\n[drives.theta1]'),
    "drives.theta1.csv": ("values = [22.7, 28.16", 'csv = "named"\n#'),
    "dimensions.l2.law.csv": ("tolerance = 0.0", 'tolerance = 1\nlaw = { csv = "named", column = "d" }\n#'),
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    place = tmp_path / "mine"
    (place / "below").mkdir(parents=True)
    (tmp_path / "secret").write_text(SECRET)
    (place / "below" / "part").write_text(SECRET)
    return place


def text(key: str) -> str:
    """The four-bar with a file named at a key."""
    old, new = NAMING[key]
    whole = jp.examples.text("four-bar")
    assert old in whole
    return whole.replace(old, new, 1)


@pytest.mark.parametrize("key", NAMING)
@pytest.mark.parametrize("target", ["../secret", "../nothing", "/etc/passwd", "..", "again"])
def test_a_link_that_leads_out_of_the_folder_is_refused_and_nothing_of_it_is_shown(
    folder: Path, key: str, target: str
) -> None:
    """A link in a folder that somebody sent was followed, and the message showed the first line of a private file."""
    (folder / "m.toml").write_text(text(key))
    (folder / "again").symlink_to("../secret")
    (folder / "named").symlink_to(target)
    with pytest.raises(jp.InputError) as refused:
        jp.load(folder / "m.toml")
    assert refused.value.key == key
    assert refused.value.problem == '"named" is a link that leads out of the folder; copy the file into it'


@pytest.mark.parametrize("key", NAMING)
def test_links_within_the_folder_are_followed(folder: Path, key: str) -> None:
    (folder / "m.toml").write_text(text(key))
    (folder / "named").symlink_to("below/part")
    with pytest.raises(jp.InputError, match=r"secret of somebody else|is not TOML"):
        jp.load(folder / "m.toml")


def test_the_mechanism_file_may_be_a_link_itself(folder: Path, tmp_path: Path) -> None:
    """What it names is beside the link."""
    (tmp_path / "m.toml").write_text(text("drives.theta1.csv"))
    (folder / "m.toml").symlink_to("../m.toml")
    (folder / "named").write_text("theta1\n20\n30\n")
    assert jp.load(folder / "m.toml").drive_values is not None
    # And the folder may be one.
    (tmp_path / "way").symlink_to("mine")
    assert jp.load(tmp_path / "way" / "m.toml").drive_values is not None


@pytest.mark.parametrize(
    ("name", "said"),
    [
        (3, "3 is not the name of a file in the same folder"),
        ("../secret", "is not the name of a file in the same folder"),
        ("nothing", "there is no file"),
        ("n" * 5000, "there is no file"),
        ("n\0", "there is no file"),
        ("round", "there is no file"),
        ("below", "is no file"),
    ],
)
def test_what_is_no_file_of_the_folder_is_said(folder: Path, name: object, said: str) -> None:
    (folder / "round").symlink_to("round")
    with pytest.raises(jp.InputError, match=said):
        beside(folder / "m.toml", name, "m.toml", "include.0")
