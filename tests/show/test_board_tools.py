"""What each tool of the drawing board does, as a person uses it; numbers are compared with those by hand."""

import base64
import json
import tempfile
from pathlib import Path

import numpy as np
import pytest

import jointplay as jp
from helpers.browser import Browser, needs_browser
from helpers.studio import EXACT, NEWEST, SHIFT, Person, choose, number, put, served
from jointplay import examples
from jointplay.errors import one_line
from jointplay.file import toml
from jointplay.show.serving import drafts
from jointplay.show.serving.folder import Folder
from jointplay.show.serving.server import Studio

pytestmark = needs_browser

SVG = "document.querySelector('#drawing svg').getBoundingClientRect()"
NOTE = "document.getElementById('note').textContent"


def lever(drawer: Person) -> None:
    """Two bars, 60 and 80 long at a right angle, the first one on a driven pin of the ground."""
    drawer.use("b", (0, 0), (60, 0), (60, 0), (60, 80))
    drawer.use("g", (0, 0))
    drawer.use("d", (0, 0))


def welded_lever(drawer: Person) -> None:
    """The same in one piece, with the output at its end."""
    lever(drawer)
    drawer.use("w", (60, 0))
    drawer.use("o", (60, 80))


def test_a_weld_makes_one_lever_of_two_bars_and_is_a_pin_again(drawer: Person) -> None:
    welded_lever(drawer)
    m = jp.loads(drawer.text)
    assert m.value("joints.J1.type") == "fixed"
    # The end is on a circle of 100 about the pin.
    turned = np.radians(np.linspace(-20, 20, 9)) + np.arctan2(80, 60)
    np.testing.assert_allclose(
        jp.solve(m).nominal[:, :2], 100 * np.array([np.cos(turned), np.sin(turned)]).T, atol=1e-9
    )
    drawer.use("w", (60, 0))
    assert toml.parse(drawer.text)["joints"]["J1"]["type"] == "revolute"


def test_a_gear_pair_turns_by_the_ratio_of_its_teeth(drawer: Person) -> None:
    drawer.use("b", (0, 0), (0, 40), (60, 0), (60, 40))
    drawer.use("g", (0, 0), (60, 0))
    drawer.use("e", (0, 0), (60, 0))
    assert toml.parse(drawer.text)["joints"]["mesh1"]["radii"] == [30, 30]
    drawer.use("d", (0, 0))
    drawer.use("o", (60, 40))
    drawer.pick("#parts", '{"joint":"mesh1"}')
    drawer.fill("teeth.1", "40")
    m = jp.loads(drawer.text)
    assert m.value("joints.mesh1.radii") == [20, 40]
    angle = jp.solve(m).nominal[:, 2]
    # The drive has steps of 5 degrees.
    np.testing.assert_allclose(np.diff(angle), -2.5, atol=1e-9)
    drawer.pick("#way", "backlash")
    drawer.fill("backlash", "0,1")
    assert jp.loads(drawer.text).value("joints.mesh1.clearance.backlash") == 0.1
    # A wheel that is dragged takes its pitch circle along.
    drawer.press("v")
    drawer.drag((60, 0), (90, 0))
    assert jp.loads(drawer.text).value("joints.mesh1.radii") == [30, 60]


def test_a_slot_guides_the_end_of_a_rod(drawer: Person) -> None:
    drawer.use("b", (0, 0), (0, 40), (0, 40), (100, 0))
    drawer.use("g", (0, 0))
    drawer.use("t", (100, 0))
    drawer.use("d", (0, 0))
    drawer.use("o", (100, 0))
    turned = np.radians(np.linspace(-20, 20, 9))
    x = -40 * np.sin(turned) + np.sqrt(100**2 + 40**2 - (40 * np.cos(turned)) ** 2)
    np.testing.assert_allclose(jp.solve(jp.loads(drawer.text)).nominal[:, 0], x, atol=1e-9)


def test_a_spring_pulls_and_a_torsion_spring_turns(drawer: Person) -> None:
    lever(drawer)
    drawer.use("w", (60, 0))
    drawer.use("c", (60, 80), (0, 80))
    spring = toml.parse(drawer.text)["springs"]["spring1"]
    assert spring == {"on": {"bar2": [60, 80], "ground": [0, 80]}, "stiffness": 1, "free_length": 60}
    drawer.fill("springs.spring1.stiffness", "2,5")
    drawer.fill("springs.spring1.free_length", "40")
    drawer.pick("#parts", '{"joint":"J2"}')
    drawer.tap("#inspector button:nth-of-type(2)")
    raw = toml.parse(drawer.text)
    assert (raw["springs"]["spring1"]["stiffness"], raw["springs"]["spring1"]["free_length"]) == (2.5, 40)
    assert raw["springs"]["spring2"] == {"joint": "J2", "stiffness": 1, "free_angle": 0}


def test_a_dimension_is_shown_and_has_a_tolerance_with_a_law(person: Person) -> None:
    person.press("i")
    places = {name: person.where(name) for name in ("J1", "J3", "J4")}
    person.click(*places["J3"])
    person.click(*places["J4"])
    raw = toml.parse(person.text)
    # The rocker is 150 long.
    assert raw["dimensions"]["l1"] == {"body": "rocker", "between": ["J3", "J4"], "tolerance": 0.1}
    person.fill("dimensions.l1.tolerance", "0,05")
    person.pick("#inspector [data-key='dimensions.l1.law']", "uniform")
    m = jp.loads(person.text)
    assert (m.value("dimensions.l1.tolerance"), m.value("dimensions.l1.law")) == (0.05, "uniform")
    # Between two bodies it is measured, and the file stays as it is.
    text = person.text
    person.use("i", places["J1"], places["J3"])
    assert person.page.run(NOTE).startswith("J1 to J3: ")
    length = float(person.page.run(NOTE).split(": ")[1].split(" <")[0])
    assert length == pytest.approx(np.hypot(*np.subtract(places["J3"], places["J1"])), abs=1e-2)
    assert person.text == text


def test_the_output_is_a_point_of_a_bar(drawer: Person) -> None:
    lever(drawer)
    drawer.use("w", (60, 0))
    # The middle of a bar snaps.
    drawer.use("p", (60, 41))
    assert toml.parse(drawer.text)["board"]["free"]["bar2"] == [[60, 80], [60, 40]]
    drawer.use("o", (60, 40))
    assert toml.parse(drawer.text)["output"] == {"body": "bar2", "at": [60, 40]}


def test_a_picture_behind_is_scaled_by_two_points_and_undone(drawer: Person, tmp_path: Path) -> None:
    page = drawer.page
    picture = tmp_path / "sketch.png"
    picture.write_bytes(base64.b64decode(PIXEL))
    root = page.ask("DOM.getDocument")["root"]["nodeId"]
    node = page.ask("DOM.querySelector", nodeId=root, selector="#picture")["nodeId"]
    page.ask("DOM.setFileInputFiles", nodeId=node, files=[str(picture)])
    page.wait("document.querySelector('#drawing image')")
    width = "Number(document.querySelector('#drawing image').getAttribute('width'))"
    before = page.run(width)
    drawer.use("k", (-20, 0), (20, 0))
    drawer.type("80")
    drawer.press("Enter")
    # 40 units of the view are 80 of the picture.
    assert page.run(width) == pytest.approx(2 * before, rel=1e-3)
    assert drawer.text == drafts.EMPTY
    drawer.press("z", 2)
    assert page.run(width) == pytest.approx(before)
    # It goes with the file, whatever that is called from now on.
    page.run("document.getElementById('name').value = 'traced.toml'")
    drawer.press("s", 2)
    page.wait("document.getElementById('note').textContent.startsWith('saved')")
    kept = "Object.keys(localStorage).filter((key) => key.startsWith('jointplay.picture '))"
    assert [key.rpartition("/")[2] for key in page.run(kept)] == ["traced.toml"]
    drawer.press("z", 2)
    assert page.run("document.querySelector('#drawing image')") is None


#: a picture of one pixel
PIXEL = "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="


def test_a_locked_joint_stays_and_lengths_change_at_the_other_end(drawer: Person) -> None:
    lever(drawer)
    drawer.use("l", (60, 0))
    assert toml.parse(drawer.text)["board"]["locked"] == ["J1"]
    text = drawer.text
    drawer.press("v")
    drawer.drag((60, 0), (30, 30))
    assert drawer.text == text
    assert "J1 is locked" in drawer.page.run(NOTE)
    drawer.use("l", (60, 0), (0, 0))
    assert toml.parse(drawer.text)["board"]["locked"] == ["J2"]
    # The second joint is the one that moves, unless it is locked.
    drawer.pick("#parts", '{"body":"bar1"}')
    drawer.fill("J1 J2", "90")
    joints = toml.parse(drawer.text)["joints"]
    assert (joints["J1"]["at"], joints["J2"]["at"]) == ([90, 0], [0, 0])
    drawer.use("l", (0, 0))
    assert "locked" not in toml.parse(drawer.text).get("board", {})


def test_a_bar_is_copied_by_keys(drawer: Person) -> None:
    drawer.use("b", (-40, 0), (0, 30))
    drawer.use("v", (-20, 15))
    drawer.press("c", 2)
    drawer.press("v", 2)
    free = toml.parse(drawer.text)["board"]["free"]
    assert np.subtract(free["bar2"][1], free["bar2"][0]).tolist() == [40, 30]
    assert free["bar2"] != free["bar1"]


def test_bars_snap_to_horizontal_and_to_lengths_that_are_there(drawer: Person) -> None:
    drawer.press("b")
    # A bar of 42.5 upwards, which is on no grid.
    for text in ("-60;0", "42,5<90"):
        drawer.page.run("document.getElementById('typed').focus()")
        drawer.type(text)
        drawer.press("Enter")
    drawer.drag((0, 0), (43, 1))
    free = toml.parse(drawer.text)["board"]["free"]
    np.testing.assert_allclose(free["bar2"], [[0, 0], [42.5, 0]], atol=1e-8)


def test_bars_snap_to_15_degrees_and_at_right_angles_to_the_bar_that_they_join(drawer: Person) -> None:
    def ray(start: tuple[float, float], size: float, degrees: float) -> tuple[float, float]:
        return start[0] + size * np.cos(np.radians(degrees)), start[1] + size * np.sin(np.radians(degrees))

    drawer.press("b")
    drawer.drag((-60, 0), ray((-60, 0), 60, 29))
    for text in ("0;-60", "50<37"):
        drawer.page.run("document.getElementById('typed').focus()")
        drawer.type(text)
        drawer.press("Enter")
    corner = ray((0, -60), 50, 37)
    drawer.drag(corner, ray(corner, 40, 126))
    free = {name: np.array(points) for name, points in toml.parse(drawer.text)["board"]["free"].items()}
    along = free["bar1"][1] - free["bar1"][0]
    assert np.degrees(np.arctan2(*along[::-1])) == pytest.approx(30, abs=1e-6)
    across = free["bar3"][0] - corner
    assert np.degrees(np.arctan2(*across[::-1])) == pytest.approx(127, abs=1e-6)
    # With Alt it is where the pointer is, to a pixel.
    drawer.drag((-60, 0), ray((-60, 0), 60, -29), modifiers=1)
    left = toml.parse(drawer.text)["board"]["free"]["bar4"][-1]
    np.testing.assert_allclose(left, ray((-60, 0), 60, -29), atol=0.5)


def test_expressions_and_variables_are_typed_in_place(drawer: Person) -> None:
    lever(drawer)
    drawer.pick("#parts", '{"joint":"J1"}')
    drawer.fill("x", "crank = 60")
    raw = toml.parse(drawer.text)
    assert raw["variables"] == {"crank": 60}
    assert raw["joints"]["J1"]["at"] == ["crank", 0]
    drawer.fill("y", "crank / 4")
    drawer.use("o", (60, 80))
    drawer.fill("variables.crank", "48,0")
    assert toml.parse(drawer.text)["variables"] == {"crank": 48}
    drawer.pick("#parts", '{"body":"bar1"}')
    size = drawer.page.run("document.querySelector('#inspector [data-key=\"J1 J2\"]').value")
    assert float(size) == pytest.approx(np.hypot(48, 12), abs=1e-3)
    # An inch, and a name that is none.
    drawer.fill("limits.position", "0.01in")
    assert toml.parse(drawer.text)["limits"]["position"] == 0.254
    drawer.fill("limits.position", "cronk")
    assert "'cronk' is no variable: cronk = 3 makes one" in drawer.page.run(NOTE)
    assert toml.parse(drawer.text)["limits"]["position"] == 0.254


def test_loads_act_in_cases(person: Person) -> None:
    text = person.text
    person.fill("loads.0.force.1", "-12,5")
    person.fill("loads.0.case", "press")
    raw = toml.parse(person.text)
    assert "loads" not in raw
    assert raw["load_cases"]["press"][0]["force"] == [0, -12.5]
    person.page.wait("document.querySelector('#choices select')")
    person.use("f", person.where("J2"))
    person.fill("loads.0.case", "lift")
    assert [*toml.parse(person.text)["load_cases"]] == ["press", "lift"]
    person.fill("load_cases.press.0.case", "")
    raw = toml.parse(person.text)
    assert ([*raw["load_cases"]], len(raw["loads"])) == (["lift"], 1)
    for _ in range(5):
        person.press("z", 2)
    assert person.text == text


def test_a_drive_has_its_range_error_law_and_backlash(drawer: Person) -> None:
    lever(drawer)
    for key, value in [("from", "-30"), ("to", "30,5"), ("count", "5"), ("error", "0,1"), ("backlash", "0,2")]:
        drawer.fill(f"drives.drive1.{key}", value)
    drawer.pick("#inspector [data-key='drives.drive1.law']", "triangular")
    own = toml.parse(drawer.text)["drives"]["drive1"]
    assert own == {
        "joint": "J2",
        "from": -30,
        "to": 30.5,
        "count": 5,
        "error": 0.1,
        "backlash": 0.2,
        "law": "triangular",
    }
    drawer.fill("drives.drive1.backlash", "")
    assert "backlash" not in toml.parse(drawer.text)["drives"]["drive1"]


def test_drives_dimensions_and_springs_get_other_names(drawer: Person) -> None:
    lever(drawer)
    drawer.use("c", (60, 80), (0, 80))
    drawer.use("i", (0, 0), (60, 0))
    for kind, section, old in [
        ("drive", "drives", "drive1"),
        ("spring", "springs", "spring1"),
        ("dimension", "dimensions", "l1"),
    ]:
        before = toml.parse(drawer.text)
        drawer.fill(f"{kind}.{old}.name", f"my_{old}")
        raw = toml.parse(drawer.text)
        assert raw == {**before, section: {f"my_{old}": before[section][old]}}
    text = drawer.text
    drawer.fill("drive.my_drive1.name", "a b")
    assert "is not a name" in drawer.page.run(NOTE)
    assert drawer.text == text


def test_a_drive_too_many_is_refused_and_the_answers_stay(person: Person) -> None:
    text = person.text
    person.use("d", person.where("J2"))
    assert "too many drives" in person.page.run(NOTE)
    assert person.text == text
    assert not person.page.run("document.body.classList.contains('stale')")


def test_the_values_of_a_drive_are_typed(person: Person) -> None:
    person.fill("drives.theta1.values", "25; 40,5; 70")
    assert toml.parse(person.text)["drives"]["theta1"]["values"] == [25, 40.5, 70]


def test_a_clearance_is_a_bearing_with_a_price(person: Person) -> None:
    person.pick("#parts", '{"joint":"J1"}')
    person.fill("costs.J1", "0,5: 24; 1: 15")
    assert toml.parse(person.text)["costs"]["J1"]["choices"] == [{"size": 0.5, "cost": 24}, {"size": 1, "cost": 15}]
    person.fill("costs.J1", "")
    assert "costs" not in toml.parse(person.text)
    person.pick("#way", "bearing")
    person.pick("#inspector [data-key=bearing]", "C3")
    person.fill("bore", "25")
    assert jp.loads(person.text).value("joints.J1.clearance") == {"bearing": "C3", "bore": 25}


def test_the_guide_leads_through_a_first_drawing(newcomer: Person) -> None:
    newcomer.page.run("document.querySelectorAll('#start button')[1].click()")
    newcomer.page.wait("!document.getElementById('tour').hidden")
    said = []

    def step() -> None:
        said.append(int(newcomer.page.text("#tour").split(" of ")[0]))

    step()
    newcomer.use("b", (-60, -40), (-30, 0), (-30, 0), (50, 30), (50, 30), (40, -40))
    step()
    newcomer.use("g", (-60, -40), (40, -40))
    step()
    newcomer.use("d", (-60, -40))
    step()
    newcomer.use("o", (50, 30))
    step()
    newcomer.press("a", 2)
    newcomer.pick("#way", "radial")
    newcomer.fill("radial", "0,05")
    step()
    newcomer.fill("limits.position", "0,5")
    step()
    assert said == [1, 2, 3, 4, 5, 6, 7]
    newcomer.tap("#tour button")
    assert newcomer.page.run("document.getElementById('tour').hidden")


def test_the_mechanism_plays_and_the_file_stays(person: Person) -> None:
    page, text = person.page, person.text
    angle = f"Number({number('theta1')}.value)"
    begin = page.run(angle)
    page.run("document.querySelector('#drawing svg').focus()")
    person.press(" ")
    page.wait(f"Math.abs({angle} - {begin}) > 5")
    person.press(" ")
    rest = page.run(angle)
    page.wait(NEWEST)
    assert page.run(angle) == rest
    assert page.text("#transmission").startswith("Transmission angle ")
    assert 22.7 <= rest <= 76.39
    assert person.text == text
    assert page.run("document.body.dataset.saved") == "true"


def test_a_page_to_mail_plays_without_a_server_and_is_taken_back(
    person: Person, browser: Browser, tmp_path: Path
) -> None:
    page = person.page
    person.fill("limits.position", "3,5")
    text = person.text
    page.run("window.kept = null, URL.createObjectURL = (blob) => ((window.kept = blob), 'data:,')")
    person.tap("#mail")
    page.wait("window.kept")
    mailed = tmp_path / "mailed.html"
    mailed.write_text(page.run("window.kept.text()"))
    other = browser.page(mailed.as_uri(), width=800, height=600)
    other.wait("document.querySelector('.jp-viewer svg .jp-body')")
    assert "Limits missed" in other.run("document.body.innerText")
    moved = "document.querySelector('.solid .jp-body').getAttribute('d')"
    first = other.run(moved)
    other.click(".jp-controls button")
    other.wait(f"{moved} !== {json.dumps(first)}")
    assert [one for one in other.addresses if not one.startswith("file:")] == []
    assert other.complaints == []
    root = page.ask("DOM.getDocument")["root"]["nodeId"]
    node = page.ask("DOM.querySelector", nodeId=root, selector="#upload")["nodeId"]
    person.press("s", 2)
    page.wait("document.body.dataset.saved === 'true'")
    page.ask("DOM.setFileInputFiles", nodeId=node, files=[str(mailed)])
    page.wait("document.getElementById('name').value === 'mailed.toml'")
    assert person.text == text


def test_a_four_bar_is_drawn_by_keys_alone(newcomer: Person) -> None:
    newcomer.tab("document.activeElement.textContent.startsWith('an empty drawing')")
    newcomer.press("Enter")
    newcomer.page.wait("document.body.classList.contains('opened')")
    newcomer.press("b")
    for text in ("0;0", "40<90", "0;40", "100<20", "93,97;74,2", "80;0"):
        for key in text:
            newcomer.press(key)
        newcomer.press("Enter")
    raw = toml.parse(newcomer.text)
    assert len(raw["joints"]) == 1, "the third bar begins beside the second"
    # The first corner is joined; the last bar is drawn anew from the end of the second.
    newcomer.press("z", 2)
    newcomer.press("v")
    for _ in range(3):
        newcomer.press("n")
    assert newcomer.page.run(NOTE) == "bar2, point 1"
    newcomer.press("b")
    newcomer.press("Enter")
    for key in "100;-74,2":
        newcomer.press(key)
    newcomer.press("Enter")
    raw = toml.parse(newcomer.text)
    assert [joint["bodies"] for joint in raw["joints"].values()] == [["bar1", "bar2"], ["bar2", "bar3"]]
    newcomer.press("g")
    for _ in range(2):
        while "point 1" not in newcomer.page.run(NOTE):
            newcomer.press("n")
        newcomer.press("Enter")
    while "ground" not in newcomer.page.run(NOTE):
        newcomer.press("n")
    newcomer.press("d")
    newcomer.press("Enter")
    while not newcomer.page.run(NOTE).startswith("J2"):
        newcomer.press("n")
    newcomer.press("o")
    newcomer.press("Enter")
    newcomer.tab("document.activeElement.dataset.key === 'limits.position'")
    newcomer.type("0,5")
    newcomer.press("Enter")
    newcomer.page.wait("document.querySelector('#line .held')")
    assert jp.loads(newcomer.text).value("output.at") == "J2"


def test_one_goes_back_to_a_step_of_a_list(drawer: Person) -> None:
    lever(drawer)
    text = drawer.text
    page = drawer.page
    steps = page.run("[...document.querySelectorAll('#steps option')].map((one) => one.textContent)")
    assert steps == ["4: drive", "3: ground", "2: bar", "1: bar", "0: opened"]
    drawer.pick("#steps", "-3")
    assert toml.parse(drawer.text)["board"]["free"] == {"bar1": [[0, 0], [60, 0]]}
    drawer.pick("#steps", "3")
    assert drawer.text == text


def test_what_is_chosen_stays_marked_where_it_is_when_the_view_moves(person: Person) -> None:
    page = person.page
    person.pick("#parts", '{"joint":"J2"}')
    x, y = person.pixel(-50, 20)
    page.ask("Input.dispatchMouseEvent", type="mouseWheel", x=x, y=y, deltaX=0, deltaY=-200, modifiers=2)
    page.wait("import('./studio.js').then(({ board }) => board.viewer.camera.zoom > 1.2)")
    ring = "document.querySelector('.b-chosen').getAttribute('cx')"
    (at, _), left = person.pixel(*person.where("J2")), page.run(f"{SVG}.left")
    assert float(page.run(ring)) * page.run(f"{SVG}.width") / 800 == pytest.approx(at - left, abs=0.1)


def test_a_drag_keeps_the_lengths_of_the_bars_on_a_joint_and_is_one_step(drawer: Person) -> None:
    drawer.draw()
    raw, text = toml.parse(drawer.text), drawer.text
    before = {name: np.array(table["at"]) for name, table in raw["joints"].items()}
    crank, rocker = (next(n for n, at in before.items() if (*at,) == place) for place in [(-30, 0), (50, 30)])
    drawer.press("v")
    drawer.press("h")
    assert drawer.page.run("document.getElementById('keeps').value") == "lengths"
    drawer.page.run(
        "window.boxes = 0, new MutationObserver(() => { window.boxes = Math.max(window.boxes,"
        " document.querySelectorAll('.b-stays').length) })"
        ".observe(document.querySelector('#drawing svg'), { childList: true, subtree: true }), 0"
    )
    drawer.drag((-30, 0), (-60, 20))
    # Both pins of the ground have a box, and stay.
    assert drawer.page.run("window.boxes") == 2
    after = {name: np.array(table["at"]) for name, table in toml.parse(drawer.text)["joints"].items()}
    # The crank of 50 stands upright; the end of the coupler is pulled along the line from there.
    np.testing.assert_allclose(after[crank], [-60, 10], atol=1e-6)
    pulled = (before[rocker] - [-60, 10]) / np.linalg.norm(before[rocker] - [-60, 10])
    np.testing.assert_allclose(after[rocker], [-60, 10] + np.hypot(80, 30) * pulled, atol=1e-6)
    assert all((after[name] == before[name]).all() for name in before if name not in (crank, rocker))
    drawer.press("z", 2)
    assert drawer.text == text


def test_arrows_move_what_is_chosen_by_a_step_each(drawer: Person) -> None:
    lever(drawer)
    drawer.use("v", (60, 0))
    before = toml.parse(drawer.text)["joints"]["J1"]["at"]
    drawer.press("ArrowRight")
    drawer.press("ArrowUp")
    after = toml.parse(drawer.text)["joints"]["J1"]["at"]
    step = drawer.page.run("import('./studio.js').then(({ board }) => board.step())")
    np.testing.assert_allclose(np.subtract(after, before), [step, step])
    drawer.press("z", 2)
    drawer.press("z", 2)
    assert toml.parse(drawer.text)["joints"]["J1"]["at"] == before


def test_a_limit_is_dragged_in_the_plot_of_the_errors(person: Person) -> None:
    page = person.page
    page.wait("document.querySelector('#charts .grip')")
    page.run("document.querySelector('#charts svg').scrollIntoView({ block: 'center' })")
    line = "document.querySelector('#charts .limit').getBoundingClientRect()"
    x, y, axis = page.run(
        f"[{line}.left + 60, {line}.top, document.querySelector('#charts .grid').getBoundingClientRect().top]"
    )
    # Half way down to the axis, from 4.
    page.drag((x, y), (x, (y + axis) / 2))
    person.done()
    assert toml.parse(person.text)["limits"]["position"] == 2
    page.wait("document.querySelector('#line .missed')")
    person.press("z", 2)
    assert toml.parse(person.text)["limits"]["position"] == 4


def test_a_drawing_of_another_program_is_opened(drawer: Person) -> None:
    page = drawer.page
    root = page.ask("DOM.getDocument")["root"]["nodeId"]
    node = page.ask("DOM.querySelector", nodeId=root, selector="#upload")["nodeId"]
    drawing = Path(__file__).parents[2] / "docs" / "drawings" / "coupler.dxf"
    page.ask("DOM.setFileInputFiles", nodeId=node, files=[str(drawing)])
    page.wait("document.getElementById('name').value === 'coupler.toml'")
    m = jp.read(drawing)
    assert [*toml.parse(drawer.text)["joints"]] == [*m.raw["joints"]]


@pytest.mark.parametrize(
    ("name", "title"), [("My press (2).linkage2", "My press (2)"), ("a/../..\0<b>.LINKAGE2", "linkage")]
)
def test_a_linkage_of_another_program_keeps_its_name(name: str, title: str, tmp_path: Path) -> None:
    """Its title and what was said of it were those of a file that the studio had made."""
    studio = Studio(Folder(tmp_path))
    pin = '<connector id="{}" x="{}" y="0" anchor="{}"/>'
    text = f"""<linkage2><program units="Millimeters"/>{pin.format(1, 0, "true")}{pin.format(2, 9, "false")}
        <Link id="1"><connector id="1"/><connector id="2"/></Link></linkage2>"""
    assert toml.parse(studio.open({"text": text, "name": name})["text"])["title"] == title
    with pytest.raises(jp.InputError) as said:
        studio.open({"text": text[:-9], "name": name})
    assert str(said.value).startswith(one_line(name))
    assert str(tempfile.gettempdir()) not in str(said.value)


def test_nothing_is_said_of_the_mechanism_before(person: Person) -> None:
    """The verdict of the former mechanism stood beside another one until its own was there."""
    page = person.page
    page.wait("document.querySelector('#line button')")
    # The answer to the first question never comes.
    page.run(
        "window.asked = fetch, window.fetch = (name, ...rest) =>"
        " name === 'now' ? new Promise(() => {}) : window.asked(name, ...rest), 0"
    )
    choose(page, {"example": "five-bar"})
    page.wait("document.getElementById('name').value === 'five-bar.toml'")
    page.wait("document.querySelectorAll('#line button, #answer p, #charts svg, #numbers td').length === 0")


def test_wheels_that_have_one_place_in_the_start_are_refused_and_the_drawing_stays(
    folder: Path, browser: Browser
) -> None:
    """A pair of gears between the crank and the slider of the slider-crank was a traceback."""
    (folder / "slider-crank.toml").write_text(examples.text("slider-crank"))
    with served(folder, "slider-crank.toml") as server:
        page = browser.page(server.address, width=1280, height=800)
        page.wait("document.body.dataset.shown > 0")
        drawer = Person(page)
        text = drawer.text
        drawer.press("e")
        for joint in ("main", "wristpin"):
            drawer.click(*drawer.where(joint))
        said = page.run(NOTE)
        assert "joints.mesh1: the centres of 'crank' and 'slider' are at one place in the start" in said
        assert drawer.text == text
        # Typed, it stands there with its line.
        mesh = (
            '[joints.mesh]\ntype = "gear"\non = { crank = [0, 0], slider = [0, 0] }\nteeth = [2, 2]\nradii = [9, 9]\n'
        )
        page.run("document.getElementById('file').open = true, 0")
        field = "document.getElementById('text')"
        page.run(f"{field}.focus(), {field}.value += {json.dumps(mesh)}, {field}.dispatchEvent(new Event('input')), 0")
        page.wait("document.getElementById('wrong').textContent.includes('say with x and y in start.slider')")
        line = 1 + [*map(str.strip, drawer.text.splitlines())].index("[joints.mesh]")
        assert page.text("#wrong").startswith(f"line {line}: ")


def test_a_target_is_drawn_and_goes_again(drawer: Person) -> None:
    lever(drawer)
    drawer.use("o", (60, 80))
    text = drawer.text
    drawer.use("j", (-40, 60), (20, 60))
    target = toml.parse(drawer.text)["target"]
    assert target == {"line": {"through": [-40, 60], "to": [20, 60]}}
    mark = "document.querySelectorAll('.b-target').length"
    assert drawer.page.run(mark) == 1
    drawer.fill("target.tolerance", "0,5")
    drawer.fill("target.line.to.1", "75")
    assert toml.parse(drawer.text)["target"] == {"line": {"through": [-40, 60], "to": [20, 75]}, "tolerance": 0.5}
    drawer.use("r", (0, 0), (60, 80))
    assert toml.parse(drawer.text)["target"] == {"circle": {"centre": [0, 0], "radius": 100}, "tolerance": 0.5}
    # The output is at a joint of the first bar's end, on a lever of that length: it is on the circle.
    drawer.use("w", (60, 0))
    m = jp.loads(drawer.text)
    assert float(abs(jp.structural(m)["structural_error"]).max()) == pytest.approx(0, abs=1e-9)
    drawer.page.run("[...document.querySelectorAll('#inspector .target button')].at(-1).click()")
    drawer.done()
    assert "target" not in toml.parse(drawer.text)
    assert drawer.page.run(mark) == 0
    for _ in range(6):
        drawer.press("z", 2)
    assert drawer.text == text


def retyped(drawer: Person, old: str, new: str) -> str:
    """Type another passage into the text; gives the text."""
    text = drawer.text.replace(old, new)
    assert new in text
    area = "document.getElementById('text')"
    # At once: what is shown when the text opens would take the place of what nobody types.
    told = f"{area}.value = {json.dumps(text)}, {area}.dispatchEvent(new Event('change'))"
    drawer.page.run(f"document.getElementById('file').open = true, {told}, 0")
    drawer.done()
    return text


def handle(drawer: Person, title: str) -> tuple[float, float]:
    """Where a handle is, in units of the drawing."""
    box = f"[...document.querySelectorAll('.b-handle')].find((one) => one.textContent === {json.dumps(title)})"
    sides = f"['x', 'y'].map((key, k) => {box}[key].baseVal.value + {box}[['width', 'height'][k]].baseVal.value / 2)"
    x, y = drawer.page.run(f"import('./studio.js').then(({{ board }}) => board.viewer.unproject({sides}))")
    return x, y


def test_the_range_of_a_drive_has_handles(drawer: Person) -> None:
    welded_lever(drawer)
    drawer.press("v")
    text = drawer.text
    # The arc is about the pin at 0; 0, and the bar points to the right at 0 degrees.
    x, y = handle(drawer, "drive1 to")
    assert np.degrees(np.arctan2(y, x)) == pytest.approx(20, abs=0.2)
    far = np.hypot(x, y)
    drawer.drag((x, y), (far * np.cos(np.radians(75)), far * np.sin(np.radians(75))))
    own = toml.parse(drawer.text)["drives"]["drive1"]
    assert own["from"] == -20
    assert own["to"] == pytest.approx(75, abs=1)
    second = own["to"]
    assert drawer.page.run(f"Number({number('drive1')}.value)") == 0, "the configuration that was shown remains"
    x, y = handle(drawer, "drive1 from")
    drawer.drag((x, y), (far * np.cos(np.radians(-50)), far * np.sin(np.radians(-50))))
    own = toml.parse(drawer.text)["drives"]["drive1"]
    # A degree is less than a pixel there.
    assert own["from"] == pytest.approx(-50, abs=1)
    assert own["to"] == second
    # Three turns are a round arc, not one with a few corners.
    drawer.fill("drives.drive1.to", "1030")
    numbers = "document.querySelector('.b-range').getAttribute('d').match(/-?[\\d.]+/g).map(Number)"
    points = np.reshape(drawer.page.run(numbers), (-1, 2))
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    assert steps.sum() == pytest.approx(np.pi * np.ptp(points[:, 0]), rel=0.01)
    for _ in range(3):
        drawer.press("z", 2)
    assert drawer.text == text


def test_handles_of_a_whole_turn_stand_beside_each_other(drawer: Person) -> None:
    """The one of the last value hid that of the first one."""
    welded_lever(drawer)
    drawer.press("v")
    whole = retyped(drawer, "from = -20\nto = 20\ncount = 9", "from = 0\nto = 360\ncount = 9")
    for end, other, angle in (("from", "to", -40), ("to", "from", 300)):
        (x, y), second = (handle(drawer, f"drive1 {one}") for one in (end, other))
        a, b = (np.array(drawer.pixel(*place)) for place in ((x, y), second))
        # Ten units of the drawing, of which 800 are as wide as it is on the screen.
        assert np.linalg.norm(a - b) > 8.0
        far = np.hypot(x, y)
        drawer.drag((x, y), (far * np.cos(np.radians(angle)), far * np.sin(np.radians(angle))))
        own = toml.parse(drawer.text)["drives"]["drive1"]
        assert own[end] == pytest.approx(angle, abs=1)
        assert own[other] == {"from": 0, "to": 360}[other]
        drawer.press("z", 2)
        assert drawer.text == whole


def test_a_list_of_values_has_a_handle_for_each(drawer: Person) -> None:
    welded_lever(drawer)
    drawer.press("v")
    own = 'joint = "J2" # turned\nvalues = [\n  -40.0, # begin\n  "10 - 30",\n  0, 35,\n]'
    text = retyped(drawer, 'joint = "J2"\nfrom = -20\nto = 20\ncount = 9', own)
    titles = "[...document.querySelectorAll('.b-handle')].map((one) => one.textContent)"
    # An expression is changed in its field.
    assert drawer.page.run(titles) == [f"drive1 value {k}" for k in (1, 3, 4)]
    x, y = handle(drawer, "drive1 value 4")
    shown = float(drawer.page.run(f"Number({number('drive1')}.value)"))
    assert np.degrees(np.arctan2(y, x)) == pytest.approx(35, abs=0.2)
    far = np.hypot(x, y)
    drawer.drag((x, y), (far * np.cos(np.radians(70)), far * np.sin(np.radians(70))))
    values = toml.parse(drawer.text)["drives"]["drive1"]["values"]
    assert values[:3] == [-40.0, "10 - 30", 0]
    assert values[3] == pytest.approx(70, abs=1)
    assert drawer.text == text.replace("0, 35,", f"0, {values[3]},")
    assert drawer.page.run(f"Number({number('drive1')}.value)") == shown
    drawer.press("z", 2)
    assert drawer.text == text
    # The field takes what the file has.
    drawer.fill("drives.drive1.values", "-40; 10 - 30; 0; 36,5")
    assert toml.parse(drawer.text)["drives"]["drive1"]["values"] == [-40, "10 - 30", 0, 36.5]


def test_angles_in_radians_stay_radians(drawer: Person) -> None:
    welded_lever(drawer)
    drawer.press("v")
    retyped(drawer, "from = -20\nto = 20\ncount = 9", "values = [0, 0.5]")
    retyped(drawer, 'angle = "deg"', 'angle = "rad"')
    x, y = handle(drawer, "drive1 value 2")
    assert np.arctan2(y, x) == pytest.approx(0.5, abs=0.01)
    far = np.hypot(x, y)
    drawer.drag((x, y), (far * np.cos(1.2), far * np.sin(1.2)))
    assert toml.parse(drawer.text)["drives"]["drive1"]["values"] == [0, pytest.approx(1.2, abs=0.02)]


def test_a_long_list_has_ticks_and_says_so(drawer: Person) -> None:
    welded_lever(drawer)
    drawer.press("v")
    count = "document.querySelectorAll('.b-handle').length"
    ticks = "document.querySelectorAll('.b-range').length - 1"
    retyped(drawer, "from = -20\nto = 20\ncount = 9", "values = [0, 10]")
    for many, handles in [(24, 24), (25, 0)]:
        drawer.fill("drives.drive1.values", "; ".join(str(k * 3) for k in range(many)))
        assert drawer.page.run(count) == handles
        assert drawer.page.run(ticks) == (0 if handles else many)
        said = "On the drawing more than 24 values have ticks" in drawer.page.text("#inspector .drive")
        assert said == (not handles)


def test_the_stroke_of_a_slider_has_handles(drawer: Person) -> None:
    drawer.use("b", (0, 0), (60, 0))
    drawer.press("w")
    drawer.use("s", (0, 0))
    drawer.use("w", (0, 0))
    guide = next(name for name, table in toml.parse(drawer.text)["joints"].items() if table["type"] == "prismatic")
    drawer.pick("#parts", json.dumps({"joint": guide}, separators=(",", ":")))
    drawer.page.run(
        "[...document.querySelectorAll('#inspector button')].find((one) => one.textContent === 'drive it').click()"
    )
    drawer.done()
    drawer.use("o", (60, 0))
    drawer.press("v")
    drawer.fill("drives.drive1.from", "-20")
    drawer.fill("drives.drive1.to", "20")
    x, y = handle(drawer, "drive1 to")
    assert (x, y) == (pytest.approx(20, abs=0.1), pytest.approx(0, abs=0.1))
    drawer.drag((x, y), (40, 3))
    own = toml.parse(drawer.text)["drives"]["drive1"]
    assert own["from"] == -20
    assert own["to"] == pytest.approx(40, abs=1)
    retyped(drawer, f"from = -20\nto = {own['to']}\ncount = 9", f"values = {[*range(30)]}")
    numbers = "(one) => one.getAttribute('d').match(/-?[\\d.]+/g).map(Number)"
    lines = f"[...document.querySelectorAll('.b-range')].map({numbers})"
    line, *ticks = drawer.page.run(lines)
    assert len(ticks) == 30
    # Ticks stand across the guide.
    assert all(x == u and abs(v - y) == 10 for x, y, u, v in ticks)
    assert (ticks[0][0], ticks[-1][0]) == (line[0], line[-2])


def test_an_axis_of_zeros_has_its_zero_alone(person: Person) -> None:
    page = person.page
    person.fill("limits.position", "")
    labels = (
        "[...document.querySelectorAll('#charts svg')].map((svg) => [...svg.querySelectorAll('text')]"
        ".filter((one) => one.getAttribute('text-anchor') === 'end').map((one) => one.textContent))"
    )
    page.wait(EXACT)
    assert all(len(axis) > 2 for axis in page.run(labels)), "the errors of the clearances have a scale"
    for k in range(1, 5):
        put(page, f"joints.J{k}.clearance", "0")
    page.wait(EXACT)
    assert page.run(labels) == [["0", "theta1 [deg]"]] * 2
    heights = "new Set([...document.querySelectorAll('#charts .dot')].map((one) => one.getAttribute('cy'))).size"
    assert page.run(heights) == 1


BOX = "(({ left, right, top, bottom }) => [left, right, top, bottom])"
REGION = "document.querySelector('#drawing .region path, #drawing .region polygon')?.getBoundingClientRect().width ?? 0"


def test_errors_of_what_is_drawn_are_magnified_until_they_are_seen(drawer: Person) -> None:
    factor = "import('./studio.js').then(({ board }) => board.viewer.factor)"
    drawer.draw()
    drawer.page.wait(EXACT)
    # What is rounding is no error.
    assert drawer.page.run(factor) == 1
    drawer.press("a", 2)
    drawer.pick("#way", "fit")
    drawer.fill("diameter", "12")
    drawer.pick("#fit", "H8/f7")
    drawer.press("v")
    drawer.page.wait(f"{EXACT} && ({REGION}) > 5")
    assert 10 < drawer.page.run(factor) < 1000


def test_the_present_one_stands_beside_what_is_kept(person: Person) -> None:
    person.page.wait(EXACT)
    person.page.run("document.getElementById('variants').open = true, 0")
    person.tap("#keep")
    before = person.page.run(CELLS)
    assert all(kept == present != "" for kept, present in before)
    put(person.page, "joints.J2.clearance", 0.2)
    person.page.wait(EXACT)
    after = person.page.run(CELLS)
    assert [kept for kept, _ in after] == [kept for kept, _ in before]
    assert all(kept != present for kept, present in after[:2])


CELLS = (
    "[...document.querySelectorAll('#variants tbody tr')]"
    ".map((row) => [...row.querySelectorAll('td')].map(({ textContent }) => textContent))"
)


def test_variants_survive_a_closed_page(folder: Path, browser: Browser) -> None:
    with served(folder) as server:
        person = Person(browser.page(server.address, width=1280, height=800))
        person.page.wait(EXACT)
        text = person.text
        person.page.run("document.getElementById('variants').open = true, 0")
        person.tap("#keep")
        before = person.page.run(CELLS)
        person.page.close()
        page = browser.page(server.address, width=1280, height=800)
        page.wait(EXACT)
        assert [kept for kept, _ in page.run(CELLS)] == [kept for kept, _ in before]
        page.run("document.getElementById('variants').open = true, 0")
        put(page, "joints.J2.clearance", 0.2)
        page.wait(EXACT)
        again = Person(page)
        again.tap("#variants thead button")
        assert page.run(f"{number('joints.J2.clearance')}.value") == "1"
        assert again.text == text
        # What is dropped is dropped, and another file has none of them.
        choose(page, {"file": "four-bar-fits.toml"})
        page.wait("document.getElementById('title').textContent.includes('too much play')")
        assert page.run(CELLS) == []


def test_a_move_says_that_it_changes_nothing_and_marks_no_text(person: Person) -> None:
    text = person.text
    x, y = person.where("J2")
    person.drag((x, y), (x - 20, y + 5), SHIFT)
    assert "the file does not change" in person.page.text("#note")
    assert person.page.run("getSelection().isCollapsed")
    assert person.text == text


def test_the_text_stands_beside_the_drawing(person: Person) -> None:
    person.page.click("#file summary")
    person.page.run("scrollTo(0, 0)")
    _, edge, top, bottom = person.page.run(f"{BOX}({SVG})")
    left, _, begin, end = person.page.run(f"{BOX}(document.getElementById('text').getBoundingClientRect())")
    assert left >= edge
    assert min(end, bottom) - max(begin, top) > 0.8 * (bottom - top)


def test_the_length_of_a_bar_that_is_not_joined_yet_is_typed(drawer: Person) -> None:
    drawer.use("b", (-60, -40), (-30, 0))
    drawer.press("v")
    drawer.pick("#parts", '{"body":"bar1"}')
    drawer.fill("point 1 point 2", "25,0")
    assert toml.parse(drawer.text)["board"]["free"]["bar1"] == [[-60, -40], pytest.approx([-45, -20])]


def test_a_component_with_a_limit_has_its_curves(folder: Path, browser: Browser) -> None:
    with served(folder, "four-bar-fits.toml") as server:
        page = browser.page(server.address, width=1280, height=800)
        page.wait(EXACT)
        every = "[...document.querySelectorAll('#charts svg')]"
        charts = f"{every}.map((svg) => [svg.ariaLabel, svg.querySelectorAll('.limit').length])"
        titles = {"position": 1, "rotation": 0, "y": 2, "angle": 2}
        assert page.run(charts) == [[f"{name} along the path", count] for name, count in titles.items()]
        # Both ends of the worst case, between the ends of the axis.
        low, high = page.run(f"[...{every}[2].querySelectorAll('.curve.worst')].map((one) => one.getBBox().y)")
        assert 24 < high < low < 190 - 34


def test_enter_leaves_a_number_of_a_slider(person: Person) -> None:
    person.page.run(f"{number('loads.0.force.1')}.focus(), {number('loads.0.force.1')}.select(), 0")
    text = person.text
    person.type("-12,5")
    person.press("Enter")
    person.page.wait("!document.getElementById('undo').disabled")
    person.press("z", 2)
    person.page.wait("document.getElementById('undo').disabled")
    assert (person.text, person.page.run(f"{number('loads.0.force.1')}.value")) == (text, "-10")


def test_in_space_joints_are_chosen_where_they_are_seen(folder: Path, browser: Browser) -> None:
    (folder / "stewart-gough.toml").write_text(examples.text("stewart-gough"))
    with served(folder, "stewart-gough.toml") as server:
        page = browser.page(server.address, width=1280, height=800)
        page.wait("document.body.dataset.shown > 0")
        spots = "board.board.joints.map(({ name }) => board.spot({ joint: name }))"
        assert None not in page.run(f"import('./studio.js').then(({{ board }}) => {spots})")
        person = Person(page)
        person.press("n")
        assert page.text("#inspector h2").startswith("base1: universal")
        assert page.run("document.querySelectorAll('#drawing .b-chosen').length") == 1
        assert "edit the drawing" not in page.text("#hint")
