"""The page in a browser: it loads without errors, and its slider moves the robot."""

from __future__ import annotations

import contextlib
import json
import shutil
import subprocess
import time
import urllib.request
from functools import partial

import numpy as np
import pytest

from irlpilco_ros.view.motions import AS_SHOWN, Course, Entry, Motions

viser = pytest.importorskip("viser", reason="viser, which draws the page, is not installed")
BROWSER = shutil.which("chromium") or shutil.which("google-chrome")

JOINTS = ("lift", "shoulder", "elbow", "left_finger")
PATIENCE = 60.0


class Tab:
    """A tab of a headless browser, by the DevTools protocol."""

    def __init__(self, folder, address):
        self.process = subprocess.Popen(
            [
                BROWSER, "--headless=new", "--no-sandbox", "--use-angle=swiftshader",
                "--enable-unsafe-swiftshader", "--remote-debugging-port=0",
                f"--user-data-dir={folder}", "--window-size=1200,900", address,
            ],
            stderr=subprocess.DEVNULL,
        )  # fmt: skip
        port_file = folder / "DevToolsActivePort"
        wait_for(port_file.exists, "the browser")
        port = wait_for(lambda: port_file.read_text().partition("\n")[0], "its port")
        self.errors = []
        self._count = 0
        self._socket = self._connect(f"http://127.0.0.1:{port}/json/list")
        for domain in ("Runtime", "Log"):
            self.send(f"{domain}.enable")

    def _connect(self, index):
        from websockets.sync.client import connect

        def address():
            with urllib.request.urlopen(index) as answer:
                pages = [each for each in json.load(answer) if each["type"] == "page"]
            return pages[0]["webSocketDebuggerUrl"] if pages else None

        return connect(wait_for(address, "a page"), max_size=None)

    def send(self, method, **parameters):
        """Do something in the browser, and return what came of it."""
        self._count += 1
        message = {"id": self._count, "method": method, "params": parameters}
        self._socket.send(json.dumps(message))
        while True:
            answer = json.loads(self._socket.recv(timeout=PATIENCE))
            self._note(answer)
            if answer.get("id") == self._count:
                return answer["result"]

    def run(self, script):
        return self.send("Runtime.evaluate", expression=script)["result"].get("value")

    def press(self, key):
        for kind in ("keyDown", "keyUp"):
            self.send("Input.dispatchKeyEvent", type=kind, key=key, code=key)

    def close(self):
        with contextlib.suppress(Exception):
            self.send("Browser.close")
        self._socket.close()
        self.process.terminate()
        self.process.wait(PATIENCE)

    def _note(self, answer):
        method, parameters = answer.get("method"), answer.get("params", {})
        if method == "Runtime.exceptionThrown":
            self.errors.append(str(parameters["exceptionDetails"]))
        is_error = parameters.get("type") == "error"
        if method == "Runtime.consoleAPICalled" and is_error:
            self.errors.append(str(parameters["args"]))
        if method == "Log.entryAdded" and parameters["entry"]["level"] == "error":
            self.errors.append(parameters["entry"]["text"])


def wait_for(condition, what):
    end = time.monotonic() + PATIENCE
    while True:
        with contextlib.suppress(OSError):
            value = condition()
            if value:
                return value
        assert time.monotonic() < end, f"waited {PATIENCE} s in vain for {what}"
        time.sleep(0.05)


def course(late):
    times = np.linspace(0.0, 2.0, 101)
    wanted = np.stack([0.1 * times, np.sin(times), times, 0.01 * times], axis=1)
    ticks = np.linspace(0.0, 2.0, 5)
    band = np.stack([np.zeros((5, 4)), np.full((5, 4), 0.1)])
    return Course(times, wanted + late, wanted, ticks, band)


@pytest.fixture
def page():
    from urdf_examples import ARM

    from irlpilco_ros.view.page import Page
    from irlpilco_ros.view.urdf_look import links_of

    entries = tuple(Entry(f"iteration {k}", AS_SHOWN, partial(course, 0.1 / k)) for k in (1, 2))
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        yield Page(server, Motions("test", JOINTS, entries, 1), links_of(ARM))
    finally:
        server.stop()


def turned(page):
    """How the shoulder is turned: half the cosine of its angle, and so on."""
    return np.array(page._robot._joints["shoulder"][1].wxyz)


def test_the_page_shows_what_is_chosen(page):
    assert "0.0500 rad and m off the demonstration" in page._words.content
    page._trial.value = "iteration 1"
    page._choose()
    assert "0.1000 rad and m off the demonstration" in page._words.content
    before = turned(page)
    page._time.value = 1.5
    page._show_time()
    assert np.abs(turned(page) - before).max() > 0.1
    page._toggle()
    end = time.monotonic() + 0.3
    page.play_for_ever(lambda: time.monotonic() < end)
    assert page._time.value != 1.5


def test_a_running_robot_takes_the_place_of_the_motion_and_what_was_shown_that_of_its_ghost(page):
    page.follow({"shoulder": 0.5}, {"shoulder": 0.6}, "**live**")
    ghost = np.array(page._ghost._joints["shoulder"][1].wxyz)
    assert np.abs(ghost - turned(page)).max() > 0.01
    before = turned(page)
    page._time.value = 1.5
    page._show_time()
    np.testing.assert_array_equal(turned(page), before)
    assert page._words.content == "**live**"


@pytest.mark.skipif(BROWSER is None, reason="there is no chromium")
def test_it_loads_without_errors_and_the_slider_moves_the_robot(page, tmp_path):
    tab = Tab(tmp_path / "profile", f"http://127.0.0.1:{page._server.get_port()}")
    try:
        slider = "document.querySelector('[role=slider]')"
        wait_for(lambda: tab.run(f"!!{slider}"), "the slider")
        wait_for(lambda: tab.run("!!document.querySelector('canvas')"), "the scene")
        before = turned(page)
        tab.run(f"{slider}.focus()")
        tab.press("End")
        wait_for(lambda: page._time.value == 2.0, "the end of the motion")
        wait_for(lambda: np.abs(turned(page) - before).max() > 0.1, "the robot to move")
        text = tab.run("document.body.innerText")
        assert "0.0500 rad and m off the demonstration" in text
        assert not tab.errors
    finally:
        tab.close()
