"""The program on a terminal: lines that fit, progress that goes away, colors, a picture, and none of these elsewhere."""

import os
import re
import subprocess
import sys

import pytest

pty = pytest.importorskip("pty")

SCENE = "input: {expression: '1 + 0.5*sin(2*pi*x)'}\ndomain: {box: [[0, 0, 0], [1, 1, 1]], boundary: [periodic]}\n"
ESCAPES = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]|\x1b\]1337;[^\x07]*\x07|\x1b_G[^\x1b]*\x1b\\")


def on_terminal(arguments, folder, **variables):
    """Exit code, and what the program sends to a terminal of 80 columns."""
    import fcntl
    import struct
    import termios

    main, other = pty.openpty()
    fcntl.ioctl(other, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
    names = ("NO_COLOR", "COLUMNS", "TERM_PROGRAM", "KITTY_WINDOW_ID", "TMUX", "LC_TERMINAL")
    environment = {k: v for k, v in os.environ.items() if k not in names} | {"TERM": "xterm-256color"} | variables
    process = subprocess.Popen(
        [sys.executable, "-m", "sph_prep", *arguments], stdin=other, stdout=other, stderr=other, cwd=folder, env=environment
    )
    os.close(other)
    sent = b""
    while True:
        try:
            part = os.read(main, 65536)
        except OSError:
            break
        if not part:
            break
        sent += part
    os.close(main)
    return process.wait(), sent.decode()


def run(folder, *more, count="2000", **variables):
    (folder / "scene.yaml").write_text(SCENE)
    code, sent = on_terminal(["--scene", "scene.yaml", "--out", "ic.hdf5", "-n", count, *more], folder, **variables)
    assert code == 0, sent
    return sent


def lines(sent):
    """As they stand on the screen at the end: what was overwritten or taken away is gone."""
    return [ESCAPES.sub("", line).split("\r")[-1] for line in sent.replace("\r\n", "\n").split("\n")]


def test_lines_fit_and_the_last_says_what_was_written(tmp_path):
    sent = run(tmp_path, "--report", "ic.html")
    shown = [line for line in lines(sent) if line]
    assert max(map(len, shown)) <= 80, [line for line in shown if len(line) > 80]
    size = (tmp_path / "ic.hdf5").stat().st_size
    last = shown[-1] if shown[-1].startswith("wrote") else shown[-2] + " " + shown[-1].strip()
    assert re.match(r"wrote ic\.hdf5 \([0-9.]+ kB\) and ic\.html \([0-9.]+ [kM]B\): ", last), last
    assert f"{size / 1000:.3g}" in last and any(w in last for w in ("good", "usable", "do not use"))
    # Words are whole: those of a pipe, in its order.
    piped = subprocess.run(
        [sys.executable, "-m", "sph_prep", "--scene", "scene.yaml", "--out", "ic.hdf5", "-n", "2000", "--report", "ic.html"],
        cwd=tmp_path, capture_output=True, text=True, check=True,
    )
    assert "\x1b" not in piped.stdout and not piped.stderr
    times = re.compile(r"[0-9.]+|s|kB|MB")
    words = [[w for w in text.split() if not times.fullmatch(w.strip("()"))] for text in ("\n".join(shown), piped.stdout)]
    again = "an older"
    assert again in piped.stdout, "the second run replaces the first one's file"
    assert set(words[0]) - set(words[1]) == set()


def test_colors_follow_no_color(tmp_path):
    assert "\x1b[32mgood\x1b[0m" in run(tmp_path, count="300")
    for off in ({"NO_COLOR": "1"}, {"TERM": "dumb"}):
        sent = run(tmp_path, count="300", **off)
        assert "\x1b[3" not in sent and "    good   " in sent
    assert "\x1b[32mgood" in run(tmp_path, count="300", NO_COLOR="")
    code, sent = on_terminal(["--scene", "none.yaml", "--out", "ic.hdf5"], tmp_path)
    assert code == 2 and "\x1b[31;1merror\x1b[0m: " in sent


def test_steps_of_over_a_second_say_what_is_left(tmp_path):
    sent = run(tmp_path, count="60000")
    drawn = [ESCAPES.sub("", part).strip() for part in re.split(r"[\r\n]", sent)]
    solver = [line for line in drawn if re.match(r"solver +\[#*-*\] \d+/\d+ .* left", line)]
    assert solver and all(len(line) < 80 for line in solver), [len(line) for line in solver]
    assert not any("[" in line and " left" in line for line in lines(sent)), "a bar was left on the screen"
    assert "left" not in "".join(lines(run(tmp_path, "--quiet", count="300")))


def test_pictures_are_for_terminals_that_show_them(tmp_path):
    assert "\x1b_G" not in run(tmp_path, count="500")
    kitty = run(tmp_path, count="500", TERM="xterm-kitty")
    assert "\x1b_Gf=100,a=T" in kitty and kitty.rstrip().splitlines()[-1].startswith(("wrote", " "))
    assert "\x1b]1337;File=inline=1" in run(tmp_path, count="500", TERM_PROGRAM="iTerm.app")
    for off in ({"TMUX": "x"}, {"NO_COLOR": "1"}):
        assert "\x1b_G" not in run(tmp_path, count="500", TERM="xterm-kitty", **off)
    assert "\x1b_G" not in run(tmp_path, "--quiet", count="500", TERM="xterm-kitty")
