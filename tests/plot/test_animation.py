"""Animations show the mechanism of every configuration, whole or not at all."""

import base64
import io
import os
import re
import shutil
import stat
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import jointplay as jp
from helpers.answers import example
from jointplay.analyses.nominal import nominal
from jointplay.cli import run
from jointplay.plot import animation
from jointplay.plot.style import Style, using

SMALL = Style(width=60, dpi=60)


class TestMotion:
    def test_configurations_between_those_of_the_file(self) -> None:
        m = example("four-bar")
        motion = animation.motion_of(m, 21, None)
        own = nominal(m)
        np.testing.assert_allclose(motion.at.poses[::2], own.poses, atol=1e-12)
        between = m.with_({"drives.theta1.values": np.degrees(motion.at.drives[:, 0]).tolist()})
        np.testing.assert_allclose(motion.at.poses, nominal(between).poses, atol=1e-12)
        assert len(animation.motion_of(m, None, None).at) == 48

    def test_every_point_is_moved_by_its_error_so_many_times(self) -> None:
        m = example("four-bar")
        motion = animation.motion_of(m, 11, 3.0)
        error = jp.loaded(m).error.sel(component=["x", "y"]).values
        nominal_ = jp.solve(m).nominal.sel(component=["x", "y"]).values
        for k in (0, 7):
            with using(SMALL):
                axes = animation.frame(motion, k).axes[0]
            star = next(line for line in axes.lines if line.get_marker() == "*")
            np.testing.assert_allclose(star.get_xydata()[0], nominal_[k] + 3.0 * error[k], atol=1e-9)

    def test_the_region_is_as_many_times_as_large(self) -> None:
        m = example("four-bar")
        motion = animation.motion_of(m, 11, 3.0)
        with using(SMALL):
            axes = animation.frame(motion, 4).axes[0]
        region = next(patch for patch in axes.patches if patch.get_label() == "where the output can be")
        middle = jp.solve(m).nominal[4].sel(component=["x", "y"]).values
        reach = np.linalg.norm(region.get_xy() - middle, axis=1).max()
        assert reach == pytest.approx(3.0 * float(jp.worst(m).worst_position[4]), rel=2e-2)

    @pytest.mark.parametrize("name", ["delta-by-hand", "ball-screw", "excavator"])
    def test_frames_have_the_same_limits(self, name: str) -> None:
        """The mechanism shook when every frame had limits of its own."""
        motion = animation.motion_of(example(name), 3, None)
        limits = []
        for k in range(3):
            with using(SMALL):
                axes = animation.frame(motion, k).axes[0]
            limits.append((*axes.get_xlim(), *axes.get_ylim()))
        assert limits[0] == limits[1] == limits[2]


class TestFiles:
    def test_a_page_carries_its_pictures(self, tmp_path: Path) -> None:
        path = tmp_path / "a.html"
        m = example("four-bar").with_({"title": "<script>alert(1)</script> {x}"})
        done: list[tuple[int, int]] = []
        jp.animate(m, path, frames=4, style=SMALL, progress=lambda *step: done.append(step))
        # The region of every frame, then its picture.
        assert done == [(k, 8) for k in range(1, 9)]
        text = path.read_text(encoding="utf-8")
        assert not re.search(r"(src|href)\s*=\s*[\"']?http", text)
        assert "<script>alert" not in text
        assert "&lt;script&gt;alert(1)&lt;/script&gt; {x}" in text
        (frames,) = re.findall(r"const frames = \[(.*?)\]", text)
        pictures = [
            np.asarray(Image.open(io.BytesIO(base64.b64decode(one))).convert("RGB"))
            for one in re.findall(r'"([^"]+)"', frames)
        ]
        assert len(pictures) == 4
        assert all((pictures[0] != other).any() for other in pictures[1:])

    def test_a_gif(self, tmp_path: Path) -> None:
        path = tmp_path / "a.gif"
        jp.animate(example("slider-crank"), path, frames=3, fps=5, style=SMALL)
        with Image.open(path) as found:
            assert (found.n_frames, found.info["duration"], found.info["loop"]) == (3, 200, 0)

    def test_what_was_there_stays_when_it_is_interrupted(self, tmp_path: Path) -> None:
        path = tmp_path / "a.gif"
        path.write_bytes(b"before")

        def stop(done: int, total: int) -> None:
            raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            jp.animate(example("four-bar"), path, frames=3, style=SMALL, progress=stop)
        assert path.read_bytes() == b"before"
        assert [one.name for one in tmp_path.iterdir()] == ["a.gif"]

    @pytest.mark.parametrize("name", ["four-bar.html", "four-bar.gif"])
    def test_a_configuration_that_cannot_be_assembled_says_so(self, tmp_path: Path, name: str) -> None:
        m = example("four-bar").with_({"drives.theta1.values": [60, 300]})
        jp.animate(m, tmp_path / name, frames=2, style=SMALL)
        assert (tmp_path / name).stat().st_size > 1000

    def test_labels_that_do_not_fit_lie_over_one_another(self, tmp_path: Path) -> None:
        """matplotlib warned of it on the standard error, once a frame."""
        jp.animate(example("planetary-gear"), tmp_path / "a.gif", frames=2, style=jp.plot.Style(width=20, height=20))
        assert (tmp_path / "a.gif").stat().st_size > 200

    def test_films_without_ffmpeg(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setenv("PATH", str(tmp_path))
        with pytest.raises(
            jp.InputError, match=r"needs ffmpeg, which is not found: install it .*, or write \.html or \.gif"
        ):
            jp.animate(example("four-bar"), tmp_path / "a.mp4")
        assert list(tmp_path.iterdir()) == []

    def test_films_are_handed_to_ffmpeg(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        """With a stand-in that writes what it was given."""
        tool = tmp_path / "bin" / "ffmpeg"
        tool.parent.mkdir()
        tool.write_text('#!/bin/sh\nfor last; do :; done\necho "$@" > "$last"\n/usr/bin/wc -c >> "$last"\n')
        tool.chmod(tool.stat().st_mode | stat.S_IXUSR)
        monkeypatch.setenv("PATH", f"{tool.parent}{os.pathsep}/usr/bin{os.pathsep}/bin")
        path = tmp_path / "a.mp4"
        jp.animate(example("four-bar"), path, frames=3, fps=7, style=SMALL)
        command, count = path.read_text().splitlines()
        width, height = map(int, re.search(r"-s (\d+)x(\d+) -r 7 ", command).groups())
        assert (width % 2, height % 2) == (0, 0)
        assert int(count) == 3 * 3 * width * height

    @pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="needs ffmpeg")
    def test_a_film_shows_the_frames(self, tmp_path: Path) -> None:
        """Read back, every frame is the picture that was handed over, but for what the coding loses."""
        m, path = example("four-bar"), tmp_path / "a.mp4"
        jp.animate(m, path, frames=3, fps=5, style=SMALL)
        subprocess.run(
            ["ffmpeg", "-v", "error", "-i", path, tmp_path / "%d.png"], check=True, timeout=60, capture_output=True
        )
        motion = animation.motion_of(m, 3, None)
        assert len([*tmp_path.glob("*.png")]) == 3
        for k in range(3):
            with using(SMALL):
                drawn = animation._picture(motion, k, None).astype(float)
            found = np.asarray(Image.open(tmp_path / f"{k + 1}.png").convert("RGB"), dtype=float)
            height, width = found.shape[:2]
            assert np.abs(found - drawn[:height, :width]).mean() < 3.0

    def test_what_ffmpeg_refuses_is_said(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        tool = tmp_path / "bin" / "ffmpeg"
        tool.parent.mkdir()
        tool.write_text("#!/bin/sh\necho no coder >&2\nexit 1\n")
        tool.chmod(tool.stat().st_mode | stat.S_IXUSR)
        monkeypatch.setenv("PATH", f"{tool.parent}{os.pathsep}/usr/bin{os.pathsep}/bin")
        with pytest.raises(jp.InputError, match="ffmpeg could not write it: no coder"):
            jp.animate(example("four-bar"), tmp_path / "a.mp4", frames=2, style=SMALL)
        assert [one.name for one in tmp_path.iterdir()] == ["bin"]


class TestCommand:
    @pytest.mark.parametrize(
        ("options", "said"),
        [
            ([], "error: --output: say where the animation goes: -o NAME.html, .gif or .mp4"),
            (["-o", "a.avi"], "error: a.avi: animations are written as .mp4, .gif, .html"),
            (
                ["-o", "a.gif", "--fps", "0"],
                "error: --fps: 0 is not a number of frames per second; 1 to 60 are possible",
            ),
            (["-o", "a.gif", "--frames", "1"], "error: --frames: 1 is not a number of frames; 2 to 2000 are possible"),
            (["-o", "a.gif", "--view", "top"], "error: --view: is for mechanisms in space"),
            (["-o", "a.gif", "--style", "x"], "error: --style: 'x' is not a style"),
            (["-o", "no/a.gif"], "error: no/a.gif: there is no folder 'no' to write it to"),
        ],
    )
    def test_bad_input(
        self, options: list[str], said: str, tmp_path: Path, monkeypatch: Any, capsys: pytest.CaptureFixture[str]
    ) -> None:
        monkeypatch.chdir(tmp_path)
        run(["new", "four-bar"])
        capsys.readouterr()
        assert run(["animate", "four-bar.toml", *options]) == 2
        assert capsys.readouterr().err.startswith(said)
        assert [one.name for one in tmp_path.iterdir()] == ["four-bar.toml"]

    def test_writes(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.chdir(tmp_path)
        run(["new", "3-upu"])
        assert run(["animate", "3-upu.toml", "-o", "a.html", "--frames", "2", "--view", "front", "--size", "60mm"]) == 0
        assert (tmp_path / "a.html").stat().st_size > 2000
