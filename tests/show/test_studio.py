"""The studio: its numbers, who may ask, which files it touches, and what a person sees who plays with it."""

import http.client
import json
import re
import signal
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import jointplay as jp
from helpers.browser import Browser, Page, needs_browser
from helpers.processes import worked, working
from helpers.studio import EXACT, NEWEST, choose, number, put, served
from jointplay import cli, examples
from jointplay.analyses.nominal import nominal
from jointplay.errors import InputError
from jointplay.file import document
from jointplay.show.serving.answers import PATIENCE, STAGES, now, settled
from jointplay.show.serving.answers import opened as begin
from jointplay.show.serving.folder import Folder
from jointplay.show.serving.knobs import knobs
from jointplay.show.serving.server import Server
from jointplay.show.serving.session import Cancelled, PageQuestion, Session

FOUR_BAR = examples.text("four-bar")
#: sizes of fits are those of hole and pin when they are set one by one
WITH_FITS = ("slider-crank-cases", "four-bar-fits", "press")


def ask(session: Session, **told: Any) -> dict[str, Any]:
    """What a page gets while sliders move."""
    asked = PageQuestion.of(told)
    return now(session, asked, session.begin(asked))


def rest(session: Session, samples: int = 0, **told: Any) -> dict[str, Any]:
    """What a page gets when they rest."""
    asked = PageQuestion.of(told)
    return settled(session, asked, samples, session.begin(asked))


# --- sliders and numbers ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", examples.names())
def test_sliders_change_sizes_and_loads_and_nothing_else(name: str) -> None:
    m = jp.loads(examples.text(name))
    own = knobs(m)
    assert own
    same = m.with_({key: value for knob in own for key, value in knob.changes(knob.value).items()})
    if name not in WITH_FITS:
        assert same.core_spec == m.core_spec
    other = m.with_({key: value for knob in own for key, value in knob.changes(1.5 * knob.value + 0.1).items()})
    assert other.core_spec != m.core_spec
    # Answers take the nominal mechanism of the file.
    np.testing.assert_array_equal(nominal(other.first).poses, nominal(m.first).poses)


@pytest.mark.parametrize("name", examples.names())
def test_every_example_can_be_played_with(name: str) -> None:
    session = Session(jp.loads(examples.text(name)))
    shown = begin(session)
    key = shown["knobs"][0]["key"]
    for question in ("loaded", "worst", "random", "given"):
        found = ask(session, drives=shown["begin"], question=question, values={key: shown["knobs"][0]["value"]})
        assert "problem" not in found
        assert found["here"]["worst"]["position"]["value"] > 0.0
        assert len(found["scene"]["places"]) == 1
        assert found["path"]["worst"]["position"]["values"][0] > 0.0
        json.dumps(found, allow_nan=False)


def test_sliders_back_in_their_place_leave_the_file_as_it_is() -> None:
    """Among them those of fits, which a slider could not say again."""
    for name in ("press", "four-bar-fits", "excavator"):
        session = Session(jp.loads(examples.text(name)))
        assert session.changed({key: knob.value for key, knob in session.knobs.items()}) is session.m


@pytest.mark.parametrize(("name", "key"), [("four-bar", "joints.J2.clearance"), ("3-upu", "joints.leg2.clearance")])
def test_numbers_are_those_of_the_questions(name: str, key: str) -> None:
    m = jp.loads(examples.text(name))
    session = Session(m)
    k = len(begin(session)["along"]) - 1
    told = {"values": {key: 0.02}, "drives": begin(session)["along"][k]}
    word = "gap" if name == "3-upu" else "radial"
    changed = m.with_({f"{key}.{word}": 0.02})
    exact, linear, scatter = jp.worst(changed), jp.worst(changed, exact=False), jp.random(changed, 1024)
    moved = jp.loaded(changed).error.sel(component=[c for c in m.components if c in "xyz"])
    found, later, specimens = ask(session, **told), rest(session, **told), rest(session, 1024, **told)
    for where in (found, later):
        value = where["here"]["loaded"]["position"]["value"]
        assert value == pytest.approx(float(np.linalg.norm(moved[k])), rel=1e-9)
    assert found["here"]["worst"]["position"]["value"] == pytest.approx(float(linear.worst_position[k]), rel=1e-9)
    # The same search from the same configuration, which is not one of a batch.
    assert later["here"]["worst"]["position"]["value"] == pytest.approx(float(exact.worst_position[k]), rel=1e-6)
    np.testing.assert_array_equal(later["path"]["worst"]["position"]["values"], exact.worst_position)
    quantile = scatter.error_quantile.sel(quantity="position", probability=0.95)
    np.testing.assert_array_equal(specimens["path"]["random"]["position"]["values"], quantile)
    assert specimens["here"]["random"]["position"]["value"] == quantile[k]


def test_between_configurations_the_mechanism_is_that_of_the_drive_value() -> None:
    m = jp.loads(FOUR_BAR)
    between = m.with_({"drives.theta1.values": [41.0]})
    found = ask(Session(m), drives=[41.0])
    scene = found["scene"]
    output = jp.solve(between).nominal[0].sel(component=["x", "y"])
    np.testing.assert_allclose(scene["places"][0][scene["output"]], output, atol=1e-5 * scene["extent"])
    largest = float(jp.worst(between, exact=False).worst_position[0])
    assert found["here"]["worst"]["position"]["value"] == pytest.approx(largest, rel=1e-9)


def test_a_position_keeps_to_the_assembly_branch_of_the_path() -> None:
    """The five-bar can be assembled with its elbows to both sides, and the start chooses one."""
    m = jp.loads(examples.text("five-bar"))
    session = Session(m)
    for k, drives in enumerate(begin(session)["along"]):
        moved = [drive + 0.01 for drive in drives]
        scene = ask(session, drives=moved)["scene"]
        output = np.array(scene["places"][0][scene["output"]])
        assert np.linalg.norm(output - session.path.output[k, :2] / m.units.length) < 0.1


def test_what_cannot_be_assembled_is_said_and_the_path_stays() -> None:
    found = ask(Session(jp.loads(FOUR_BAR)), drives=[250.0])
    assert found["problem"] == "cannot be assembled at theta1 = 250 deg"
    assert "scene" not in found
    assert found["path"]["worst"]["position"]["values"]


def test_drives_are_asked_for_within_ten_turns_of_the_file() -> None:
    """All of the way to a value is traced; the crank of the slider-crank turns over, and is where it was."""
    session = Session(jp.loads(examples.text("slider-crank")))
    with pytest.raises(InputError, match=r"theta is from -3585 to 3945 here, not 1e\+12"):
        ask(session, drives=[1e12])
    far, near = (np.array(ask(session, drives=[value])["scene"]["places"]) for value in (3640.0, 40.0))
    np.testing.assert_allclose(far, near, atol=1e-6)


def test_offsets_at_the_largest_error_give_it_again() -> None:
    session = Session(jp.loads(FOUR_BAR))
    worst = rest(session, drives=[48.98])["here"]["worst"]
    found = ask(session, drives=[48.98], question="given", offsets=worst["offsets"])
    assert found["here"]["given"]["position"]["value"] == pytest.approx(worst["position"]["value"], rel=1e-9)


def test_who_is_to_blame_is_marked() -> None:
    session = Session(jp.loads(FOUR_BAR))
    for question in ("loaded", "worst", "random"):
        told = {"drives": [48.98], "question": question, "values": {"joints.J3.clearance": 3.0}}
        for found in (ask(session, **told), rest(session, **told)):
            scene = found["scene"]
            (name,) = (s for s in scene["shapes"] if s["kind"] == "name" and s["text"] == "J3")
            assert scene["blamed"] == name["points"]


def test_outputs_and_load_cases_are_chosen() -> None:
    m = jp.loads(examples.text("slider-crank-cases"))
    session = Session(m)
    drives = begin(session)["begin"]
    for output in m.outputs:
        for case in m.load_cases:
            found = ask(session, drives=drives, output=output, load_case=case, question="loaded")
            wanted = jp.loaded(m.only(output=output, load_case=case)).error.sel(component=["x", "y"])
            sizes = np.linalg.norm(wanted, axis=1)
            np.testing.assert_allclose(found["path"]["loaded"]["position"]["values"], sizes, rtol=1e-9)


def test_something_newer_cancels_what_is_asked() -> None:
    session = Session(jp.loads(FOUR_BAR))
    check = session.begin(PageQuestion(serial=5))
    check()
    session.begin(PageQuestion(serial=6))
    with pytest.raises(Cancelled):
        check()
    with pytest.raises(Cancelled):
        session.begin(PageQuestion(serial=5))
    # Long work looks after every configuration.
    asked = PageQuestion(serial=7, drives=(48.98,))
    calls: list[int] = []

    def stop(_done: int, _of: int) -> None:
        calls.append(1)
        raise Cancelled

    with pytest.raises(Cancelled):
        settled(session, asked, 1024, stop)
    assert calls == [1]


# --- files -----------------------------------------------------------------------------------------------------------


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    place = tmp_path / "mine"
    place.mkdir()
    (place / "four-bar.toml").write_text(FOUR_BAR)
    (place / "bad.toml").write_text(FOUR_BAR.replace("radial = 1.0", "radius = 1.0", 1))
    (tmp_path / "secret.toml").write_text(FOUR_BAR)
    (place / "link.toml").symlink_to(tmp_path / "secret.toml")
    (place / ".hidden.toml").write_text(FOUR_BAR)
    return place


ELSEWHERE = (
    *("../secret.toml", "/etc/passwd", "..", "", ".toml", ".hidden.toml", "link.toml", "a/b.toml", "a\\b.toml"),
    *("x.txt", "C:x.toml", "x\n.toml", "x\0.toml"),
)


@pytest.mark.parametrize("name", ELSEWHERE)
def test_names_that_lead_elsewhere_are_refused(folder: Path, name: str) -> None:
    own = Folder(folder)
    assert name not in own.names()
    opened = own.open("four-bar.toml")
    for attempt in (lambda: own.open(name), lambda: own.save(opened, opened.content, name)):
        with pytest.raises(InputError, match=r"is not the name of a \.toml file in the folder"):
            attempt()


def test_files_are_saved_with_their_comments_and_never_over_those_of_others(folder: Path) -> None:
    own = Folder(folder)
    assert own.names() == ["bad.toml", "four-bar.toml"]
    opened = own.open("four-bar.toml")
    wider = jp.loads(opened.content).with_({"joints.J1.clearance.radial": 0.5}).text("four-bar.toml")
    saved = own.save(opened, wider, "four-bar.toml")
    assert (folder / "four-bar.toml").read_text() == FOUR_BAR.replace("radial = 1.0", "radial = 0.5", 1)
    with pytest.raises(InputError, match="is there already"):
        own.save(saved, wider, "bad.toml")
    assert own.save(saved, wider, "new.toml").name == "new.toml"
    # It is saved again and again, until somebody else writes to it.
    own.save(saved, opened.content, "four-bar.toml")
    (folder / "four-bar.toml").write_text("# mine\n" + FOUR_BAR)
    with pytest.raises(InputError, match="has been changed by somebody else"):
        own.save(saved, wider, "four-bar.toml")
    assert (folder / "four-bar.toml").read_text().startswith("# mine")


# --- who may ask -----------------------------------------------------------------------------------------------------


@pytest.fixture
def server(folder: Path) -> Iterator[Server]:
    with served(folder) as running:
        yield running


def request(server: Server, path: str, told: Any = None, method: str = "", **headers: str) -> tuple[int, Any, Any]:
    """Status, headers and content of an answer."""
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=60)
    content = None if told is None else told if isinstance(told, bytes) else json.dumps(told).encode()
    connection.request(method or ("GET" if told is None else "POST"), path, content, headers)
    answer = connection.getresponse()
    body = answer.read()
    connection.close()
    return answer.status, answer.headers, json.loads(body) if answer.headers["Content-Type"][12:16] == "json" else body


def test_only_those_with_the_token_get_anything(server: Server) -> None:
    own = f"/{server.token}/"
    assert request(server, own)[0] == 200
    for path in ("/", "/x/", own[:-2] + "/", own[:-1], "/" + "A" * len(server.token) + "/", own.upper()):
        assert request(server, path)[0] == 403
        assert request(server, f"{path}choices", {})[0] == 403
    assert len(server.token) >= 32


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:80", "127.0.0.1.evil.example:1", "", "[::1]:5", "127.1:5"]
)
def test_names_that_lead_here_from_elsewhere_are_refused(server: Server, host: str) -> None:
    """A page of another server can give its own name this address (DNS rebinding)."""
    assert request(server, f"/{server.token}/", Host=host)[0] == 403
    assert request(server, f"/{server.token}/choices", {}, Host=host)[0] == 403


@pytest.mark.parametrize("origin", ["https://evil.example", "null", "http://127.0.0.1:1", "http://localhost:{port}"])
def test_pages_of_other_origins_are_refused(server: Server, origin: str) -> None:
    other = origin.format(port=server.port)
    assert request(server, f"/{server.token}/choices", {}, Origin=other)[0] == 403
    own = f"http://127.0.0.1:{server.port}"
    assert request(server, f"/{server.token}/choices", {}, Origin=own)[0] == 200


def test_what_is_sent_may_do_nothing_but_ask_this_server(server: Server) -> None:
    _, headers, _ = request(server, f"/{server.token}/")
    policy = headers["Content-Security-Policy"]
    assert policy.startswith("default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'")
    assert "unsafe" not in policy
    assert headers["Referrer-Policy"] == "no-referrer"
    assert "Access-Control-Allow-Origin" not in headers


@pytest.mark.parametrize(
    ("path", "told", "code"),
    [
        ("nothing", None, 404),
        ("../../etc/passwd", None, 404),
        ("nothing", {}, 404),
        ("open", b"{", 400),
        ("open", b"[]", 400),
        ("open", b"\xff", 400),
        ("open", b"[" * 100_000, 400),
        ("now", {}, 400),
        ("now", {"page": "x"}, 400),
        ("open", {"example": "nothing"}, 400),
        ("open", {"file": "../secret.toml"}, 400),
        ("open", {"text": "x = ", "name": "mine.toml"}, 400),
    ],
)
def test_what_is_not_asked_by_a_page_is_refused_in_one_line(server: Server, path: str, told: Any, code: int) -> None:
    status, _, found = request(server, f"/{server.token}/{path}", told)
    assert status == code
    assert found["error"].count("\n") == 0
    assert "Traceback" not in found["error"]
    assert request(server, f"/{server.token}/choices", {})[0] == 200


@pytest.mark.parametrize(
    "told",
    [
        {"drives": []},
        {"drives": [1.0, 2.0]},
        {"drives": ["x"]},
        {"drives": 3},
        {"values": {"joints.J9.clearance": 1.0}},
        {"values": [1]},
        {"values": {"joints.J1.clearance": 1e300}},
        {"question": "given", "offsets": {"J9.x": 1.0}},
        {"output": ["x"]},
        {"load_case": 5},
        {"serial": "x"},
        {"serial": float("inf")},
        {"drives": [1e300]},
        {"values": {"joints.J1.clearance": 10**400}},
        {"drives": [float("nan")], "samples": 3},
    ],
)
def test_what_no_page_of_ours_asks_is_refused(server: Server, told: dict[str, Any]) -> None:
    own = f"/{server.token}/"
    page = request(server, f"{own}open", {"file": "four-bar.toml"})[2]["page"]
    for name in ("now", "settled"):
        if "samples" not in told or name == "settled":
            status, _, found = request(server, f"{own}{name}", {"drives": [40.0], "page": page, **told})
            assert (status, "Traceback" in found["error"]) == (400, False)


@pytest.mark.parametrize("half", ["joints = 3", "units = 3", "drives = [1]", "bodies = 'x'", "springs = 3"])
def test_a_half_typed_text_drops_no_connection(server: Server, half: str) -> None:
    def post(name: str, **told: Any) -> Any:
        return request(server, f"/{server.token}/{name}", told)[2]

    page = post("edit", page=post("open", new=True)["page"], text=half)["page"]
    for kind in ("joint", "drive", "spring", "body"):
        assert "error" in post("edit", page=page, rename=[kind, "a", "b"])
    assert post("fits", page=page, diameter=12)["fits"]


def test_the_length_of_a_request_is_limited(server: Server) -> None:
    for length in ("99999999999", "9" * 5000, "-1", "x", ""):
        with socket.create_connection(("127.0.0.1", server.port)) as plain:
            head = f"POST /{server.token}/open HTTP/1.1\r\nHost: 127.0.0.1:1\r\nContent-Length: {length}\r\n\r\n"
            plain.sendall(head.encode())
            assert plain.recv(100).startswith(b"HTTP/1.1 413 ")
    assert request(server, f"/{server.token}/x", method="PUT")[0] == 501


def test_pages_do_not_disturb_each_other(server: Server) -> None:
    own = f"/{server.token}/"
    one, other = (request(server, f"{own}open", {"file": "four-bar.toml"})[2] for _ in range(2))
    third = request(server, f"{own}open", {"example": "3-upu"})[2]
    assert len({one["page"], other["page"], third["page"]}) == 3
    values = {"joints.J1.clearance": 0.5}
    moved = {"page": one["page"], "serial": 900, "drives": [40.0], "values": values}
    first = request(server, f"{own}now", moved)[2]
    second = request(server, f"{own}now", {"page": other["page"], "serial": 1, "drives": [40.0]})[2]
    again = request(server, f"{own}now", moved)[2]
    here = [found["here"]["worst"]["position"]["value"] for found in (first, second, again)]
    assert here[0] == here[2] < here[1]
    # Of one page, something older is not answered.
    assert request(server, f"{own}now", {**moved, "serial": 899})[2] == {"cancelled": True}


def test_a_bad_file_says_what_is_wrong(server: Server) -> None:
    status, _, found = request(server, f"/{server.token}/open", {"file": "bad.toml"})
    assert status == 400
    assert re.search(r"bad\.toml: joints\.J1\.clearance.*did you mean 'radial'", found["error"])
    opened = request(server, f"/{server.token}/open", {"file": "four-bar.toml"})[2]
    told = {"page": opened["page"], "serial": 1, "drives": [40.0], "values": {"joints.J1.clearance": -1.0}}
    status, _, found = request(server, f"/{server.token}/now", told)
    assert status == 400
    assert "joints.J1.clearance" in found["error"]


def test_the_report_of_a_page_is_that_of_its_sliders(server: Server) -> None:
    own = f"/{server.token}/"
    page = request(server, f"{own}open", {"example": "redundant-bar"})[2]["page"]
    told = {"page": page, "values": {"joints.P.clearance": 0.0625}}
    html = request(server, f"{own}report", told)[2]["html"]
    assert "radial = 0.0625" in html
    assert html.startswith("<!DOCTYPE html>")
    assert "radial = 0.0625" in request(server, f"{own}text", told)[2]["text"]


# --- the command -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("busy", [False, True])
def test_ctrl_c_stops_it(folder: Path, busy: bool) -> None:
    with working(["studio", "four-bar.toml", "--no-browser"], folder) as process:
        assert process.stdout is not None
        address = process.stdout.readline().strip()
        found = re.fullmatch(r"http://127\.0\.0\.1:(\d+)/([\w-]{32,})/", address)
        assert found
        assert process.stdout.readline() == "Ctrl-C stops it.\n"
        if busy:
            connection = http.client.HTTPConnection("127.0.0.1", int(found[1]), timeout=60)
            connection.request("POST", f"/{found[2]}/open", json.dumps({"example": "planetary-gear"}))
            page = json.loads(connection.getresponse().read())["page"]
            told = {"page": page, "drives": [180.0], "samples": 131_072}
            connection.request("POST", f"/{found[2]}/settled", json.dumps(told))
            worked(process, 3.0)
            connection.close()
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
    assert process.returncode == 0
    assert out == "stopped\n"
    assert err == ""


def test_what_cannot_be_served_is_refused(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    assert cli.run(["studio", "nothing.toml"]) == 2
    assert capsys.readouterr().err == (
        "error: nothing.toml: there is no such file; `jointplay studio` alone begins with an example\n"
    )
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert cli.run(["studio", "--port", str(port), "--no-browser"]) == 2
        assert capsys.readouterr().err.startswith(f"error: --port: port {port} cannot be used: ")
    for port in (-1, 70_000):
        assert cli.run(["studio", "--port", str(port)]) == 2
        assert "--port" in capsys.readouterr().err


# --- what a person sees ----------------------------------------------------------------------------------------------


def value(page: Page, question: str, quantity: int = 1) -> float:
    """A number of the table."""
    return float(page.run(f"document.querySelector('#numbers tr.{question}').cells[{quantity}].dataset.value"))


#: how the numbers of the table have been found
FOUND = "[...document.querySelectorAll('#numbers tbody tr')].map((row) => row.cells[3].textContent)"


@needs_browser
class TestInABrowser:
    def test_a_slider_is_dragged_and_the_numbers_follow(self, folder: Path, browser: Browser) -> None:
        """Here all specimens are asked for that there is time for, of a short path."""
        short = document.edited(FOUR_BAR, ("drives", "theta1", "values"), [43.83, 48.98, 54.17])
        (folder / "short.toml").write_text(short)
        with served(folder, "short.toml", PATIENCE) as server:
            self.dragged(server, browser)

    def dragged(self, server: Server, browser: Browser) -> None:
        page = browser.page(server.address)
        page.wait(f"{FOUND}[1] === 'exact'")
        m = jp.loads(FOUR_BAR)
        assert page.text("h1") == m.title
        colours = "[...document.querySelectorAll('#numbers th')].map((cell) => getComputedStyle(cell).borderLeftColor)"
        assert page.run(colours)[-3:] == ["rgb(0, 114, 178)", "rgb(192, 79, 0)", "rgb(0, 121, 90)"]
        before = value(page, "worst")
        slider = "[data-name='joints.J2.clearance'] input"
        x, y, width = page.middle(slider)
        # From 1 of 3 to about 2. As long as it is held all but the loaded position is marked as not exact.
        page.mouse("mousePressed", x - width / 6, y)
        for k in range(8):
            page.mouse("mouseMoved", x - width / 6 + (k + 1) * width / 24, y)
        page.wait(f"{NEWEST} && {number('joints.J2.clearance')}.value > 1.5")
        assert page.run(FOUND) == ["exact", "to first order", "256 specimens"]
        assert page.text("#state") == "not yet exact"
        # What changes while a question is on its way is asked when the answer is there.
        move = "(range.value = {}, range.dispatchEvent(new Event('input')))"
        page.run(
            f"(() => {{ const range = document.querySelector(`{slider}`); {move.format(1.6)}; {move.format(1.9)} }})()"
        )
        page.wait(f"{NEWEST} && {number('joints.J2.clearance')}.value === '1.9'")
        page.mouse("mouseReleased", x + width / 6, y)
        page.wait(EXACT)
        size = float(page.run(f"{number('joints.J2.clearance')}.value"))
        assert 1.5 < size < 2.5
        changed = m.with_({"joints.J2.clearance.radial": size, "drives.theta1.values": [48.98]})
        assert value(page, "worst") > before
        assert value(page, "worst") == pytest.approx(float(jp.worst(changed).worst_position[0]), rel=1e-6)
        moved = jp.loaded(changed).error[0].sel(component=["x", "y"])
        assert value(page, "loaded") == pytest.approx(float(np.linalg.norm(moved)), rel=1e-9)
        # How many there are at last depends on how long they take.
        assert page.run(FOUND)[:2] == ["exact", "exact"]
        assert page.run(FOUND)[2] in [f"{count:,} specimens" for count in STAGES]
        assert page.text("#state") == "exact"
        own = f"http://127.0.0.1:{server.port}/{server.token}/"
        assert [address for address in page.addresses if not address.startswith((own, "data:"))] == []
        assert page.complaints == []

    def test_the_output_is_dragged_along_its_path(self, server: Server, browser: Browser) -> None:
        page = browser.page(server.address)
        page.wait(EXACT)
        page.click("[data-tool=move]")
        before = page.run("document.querySelector('.jp-output').getAttribute('d')")
        place = "(({x, y, width, height}) => [x + width / 2, y + height / 2])"
        page.run("document.querySelector('#drawing svg').scrollIntoView()")
        box = page.run(f"{place}(document.querySelector('.jp-output').getBoundingClientRect())")
        page.drag((box[0], box[1]), (box[0] - 60, box[1] - 40))
        page.wait(EXACT)
        angle = float(page.run(f"{number('theta1')}.value"))
        assert 48.98 < angle <= 76.39
        assert page.run("document.querySelector('.jp-output').getAttribute('d')") != before
        assert value(page, "worst") == pytest.approx(
            float(jp.worst(jp.loads(FOUR_BAR).with_({"drives.theta1.values": [angle]})).worst_position[0]), rel=1e-4
        )

    def test_two_pages_at_once(self, server: Server, browser: Browser) -> None:
        one, other = browser.page(server.address), browser.page(server.address)
        for page in (one, other):
            page.wait(EXACT)
        before = value(other, "worst")
        put(one, "joints.J1.clearance", 3.0)
        other.click("[name=question][value=random]")
        for page in (one, other):
            page.wait(EXACT)
        assert value(other, "worst") == before < value(one, "worst")
        assert other.run("document.querySelectorAll('.jp-cloud').length") == 1
        assert one.run("document.querySelectorAll('.jp-cloud').length") == 0

    def test_a_bad_file_is_said_and_the_page_lives(self, folder: Path, browser: Browser) -> None:
        with served(folder, "bad.toml") as server:
            page = browser.page(server.address)
            page.wait("document.querySelector('#note.alarm')")
            assert "did you mean 'radial'" in page.text("#note")
            choose(page, {"file": "four-bar.toml"})
            page.wait(EXACT)
            assert page.text("#note") == ""
            # A drive value that cannot be reached, and back.
            put(page, "theta1", 250.0)
            page.wait("document.querySelector('#note.alarm')")
            assert page.text("#note") == "cannot be assembled at theta1 = 250 deg"
            put(page, "theta1", 50.0)
            page.wait("!document.querySelector('#note.alarm')")
            page.wait(EXACT)

    def test_without_a_file_there_is_a_choice_and_what_is_changed_is_saved(
        self, folder: Path, browser: Browser
    ) -> None:
        with served(folder, "") as server:
            page = browser.page(server.address, width=390)
            page.wait("document.querySelectorAll('#open option').length > 20")
            choose(page, {"example": "redundant-bar"})
            page.wait(EXACT)
            assert page.run("document.documentElement.scrollWidth") <= 390
            put(page, "joints.P.clearance", 0.0625)
            page.wait(EXACT)
            page.click("#save")
            page.wait("document.querySelector('#note').textContent === 'saved redundant-bar.toml'")
        text = examples.text("redundant-bar")
        assert (folder / "redundant-bar.toml").read_text() == text.replace("radial = 0.1", "radial = 0.0625", 1)

    def test_texts_of_a_file_stay_texts(self, folder: Path, browser: Browser) -> None:
        evil = "<img src=x onerror=document.title=1>"
        text = re.sub(r"title\s*=.*", f"title = '{evil}'", FOUR_BAR, count=1)
        (folder / "evil.toml").write_text(re.sub(r'"?\bcoupler\b"?', "'<b>&amp;'", text))
        with served(folder, "evil.toml") as server:
            page = browser.page(server.address)
            page.wait(EXACT)
            assert page.text("h1") == evil
            assert page.run("document.images.length") == 0
            assert page.complaints == []
