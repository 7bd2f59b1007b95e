"""The page: the robot, its ghost, a time slider, and curves of the joints."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from irlpilco_ros.experience.robot_settings import units_of
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.report.run_summary import all_of
from irlpilco_ros.view.motions import Course, Motions
from irlpilco_ros.view.robot_drawing import RobotDrawing
from irlpilco_ros.view.urdf_look import Link

GHOST = (0.35, 0.55, 0.95, 0.35)
"""Colour and opacity of the demonstration's ghost."""

OBJECT = "object"
"""Link that lies where the object does, if the URDF has one."""

SPEEDS = ("0.1", "0.25", "0.5", "1", "2", "4")
_FRAME = 1.0 / 30.0  # [s] between two pictures
_STEP = 0.01  # [s] of the slider
_HEIGHT = 220  # [px] of a chart
_COLOURS = (
    "#1b6ca8", "#d1495b", "#2e8b57", "#e08e0b", "#7a4fb5", "#008b8b", "#8c564b",
    "#556b2f", "#c71585", "#4169e1", "#a0522d", "#20b2aa", "#b8860b", "#708090",
)  # fmt: skip
_MILLI = 1e3
_VISIBLE = 2e-3  # [rad] that a running robot moves before it is drawn anew: more than noise
_SIGMAS = 2.0  # standard deviations of the predicted band


class Page:
    """What one looks at and clicks on; all of it follows the chosen motion and time."""

    def __init__(self, server: Any, motions: Motions, links: Sequence[Link]) -> None:
        """Draw the robot and the controls; the first motion is chosen, time stands at 0.

        Args:
            server: A viser.ViserServer.
            motions: What can be looked at.
            links: What the robot looks like.
        """
        self._server, self._motions = server, motions
        sliding = {link.joint for link in links if link.kind == "prismatic"}
        self._units = units_of(motions.joints, sliding)
        self._lock = threading.RLock()
        self._entry = motions.entries[motions.first]
        self._course: Course = self._entry.read()
        self._robot = RobotDrawing(server, "robot", links)
        self._ghost = RobotDrawing(server, "ghost", links, GHOST)
        self._playing = False
        self._live: dict[str, float] = {}
        self._live_ghost: dict[str, float] = {}
        _set_scene(server)
        gui = server.gui
        gui.configure_theme(control_width="large", show_logo=False)
        gui.set_panel_label(motions.title)
        self._place = _dropdown(gui, "place", motions.places, self._entry.place)
        self._trial = _dropdown(gui, "motion", self._names(), self._entry.name)
        self._words = gui.add_markdown("")
        self._time = gui.add_slider("time [s]", 0.0, self._end, _STEP, 0.0)
        self._play = gui.add_button("play")
        self._speed = _dropdown(gui, "speed", SPEEDS, "1")
        self._show_ghost = gui.add_checkbox("demonstration as a ghost", True)
        self._errors = gui.add_uplot(**self._error_chart())
        self._joint = _dropdown(gui, "joint", motions.joints, self._worst())
        self._curves = gui.add_uplot(**self._joint_chart())
        self._listen()
        self._show_course()

    def play_for_ever(self, go_on: Callable[[], bool] = lambda: True) -> None:
        """Let time pass while somebody has it played; returns when `go_on` says no."""
        before = time.monotonic()
        while go_on():
            time.sleep(_FRAME)
            now = time.monotonic()
            passed, before = now - before, now
            if self._playing:
                later = float(self._time.value) + passed * float(self._speed.value)
                self._time.value = 0.0 if later > self._end else later
                self._show_time()

    def follow(self, positions: dict[str, float], shown: dict[str, float], words: str) -> None:
        """Show the running robot instead of a motion.

        Args:
            positions: By joint [rad].
            shown: Where the joints were shown to be at this moment of a trial [rad]: the ghost is
                there; empty while nobody says.
            words: A line on what is going on.
        """
        moved = [abs(positions[name] - self._live.get(name, np.inf)) for name in positions]
        if max(moved, default=0.0) > _VISIBLE:
            self._live = positions
            self._robot.move(positions)
        if shown and shown != self._live_ghost:
            self._live_ghost = shown
            self._ghost.root.visible = bool(self._show_ghost.value)
            self._ghost.move(shown)
        if words != self._words.content:
            self._words.content = words

    def _listen(self) -> None:
        self._place.on_update(lambda _: self._choose_place())
        self._trial.on_update(lambda _: self._choose())
        self._time.on_update(lambda _: self._show_time())
        self._play.on_click(lambda _: self._toggle())
        self._show_ghost.on_update(lambda _: self._show_time())
        self._joint.on_update(lambda _: self._draw_curves())

    @property
    def _end(self) -> float:
        return float(max(self._course.times[-1], _STEP))

    def _names(self) -> tuple[str, ...]:
        place = self._place.value
        return tuple(entry.name for entry in self._motions.entries if entry.place == place)

    def _worst(self) -> str:
        """Return the joint that is farthest from what was shown."""
        return self._motions.joints[int(np.abs(self._course.error).max(axis=0).argmax())]

    def _choose_place(self) -> None:
        with self._lock:
            names = self._names()
            self._trial.options = names
            self._trial.value = names[-1]
            self._choose()

    def _choose(self) -> None:
        with self._lock:
            chosen = (self._place.value, self._trial.value)
            found = [each for each in self._motions.entries if (each.place, each.name) == chosen]
            if not found or found[0] is self._entry:
                return
            self._entry = found[0]
            try:
                self._course = self._entry.read()
            except Exception as error:  # a bag that is damaged is told where one looks
                self._words.content = f"**{self._entry.name} cannot be read:** {error}"
                return
            self._show_course()

    def _show_course(self) -> None:
        """Bring everything up to date with the chosen motion."""
        self._time.max = self._end
        self._time.value = min(float(self._time.value), self._end)
        self._words.content = self._summary()
        self._robot.place(OBJECT, self._course.object_pose)
        self._errors.data = self._error_chart()["data"]
        self._draw_curves()
        self._show_time()

    def _summary(self) -> str:
        course = self._course
        if course.wanted is None:
            return f"{course.times[-1]:.1f} s"
        error = course.error
        sample, joint = np.unravel_index(np.abs(error).argmax(), error.shape)
        return (
            f"{course.times[-1]:.1f} s; {np.sqrt(np.mean(error**2)):.4f} {all_of(self._units)} "
            f"off the demonstration (RMS over joints and time); most "
            f"{abs(error[sample, joint]):.4f} {self._units[joint]}, "
            f"{self._motions.joints[joint]} at {course.times[sample]:.1f} s"
        )

    def _show_time(self) -> None:
        now, course = float(self._time.value), self._course
        if not self._live:
            self._robot.move(self._at(now, course.positions))
        self._ghost.root.visible = course.wanted is not None and self._show_ghost.value
        if course.wanted is not None:
            self._ghost.move(self._at(now, course.wanted))

    def _at(self, now: float, positions: Array) -> dict[str, float]:
        times = self._course.times
        return {
            joint: float(np.interp(now, times, column))
            for joint, column in zip(self._motions.joints, positions.T, strict=True)
        }

    def _toggle(self) -> None:
        self._playing = not self._playing
        self._play.label = "pause" if self._playing else "play"

    def _draw_curves(self) -> None:
        chart = self._joint_chart()
        self._curves.data, self._curves.title = chart["data"], chart["title"]

    def _error_chart(self) -> dict[str, Any]:
        """Return the error of every joint over time; where nothing was shown, its position."""
        joints, course = self._motions.joints, self._course
        is_alone = course.wanted is None
        thousandths = all_of([f"m{unit}" for unit in self._units])
        lines = [
            {"label": joint, "stroke": _COLOURS[k % len(_COLOURS)], "width": 1.2}
            for k, joint in enumerate(joints)
        ]
        return {
            "data": (course.times, *(course.positions if is_alone else _MILLI * course.error).T),
            "series": ({"label": "time [s]"}, *lines),
            "title": (
                f"joints [{all_of(self._units)}]"
                if is_alone
                else f"off the demonstration [{thousandths}]"
            ),
            **_axes(),
        }

    def _joint_chart(self) -> dict[str, Any]:
        """Return one joint: what was shown, what it did, and what was predicted of it."""
        course, name = self._course, str(self._joint.value)
        joint = self._motions.joints.index(name)
        done = course.positions[:, joint]  # also for what there is not: charts know no gaps
        wanted = done if course.wanted is None else course.wanted[:, joint]
        low, high = done, done
        if len(course.band_times):
            mean, deviation = course.band[:, :, joint]
            low, high = (
                np.interp(course.times, course.band_times, mean + side * deviation)
                for side in (-_SIGMAS, _SIGMAS)
            )
        return {
            "data": (course.times, wanted, done, high, low),
            "series": (
                {"label": "time [s]"},
                {"label": "demonstration", "stroke": "#5a8cf0", "width": 1.5, "dash": (6, 4)},
                {"label": "motion", "stroke": "#d1495b", "width": 1.5},
                {"label": f"predicted + {_SIGMAS:g} sigma", "stroke": "#2e8b5766", "width": 1},
                {"label": f"predicted - {_SIGMAS:g} sigma", "stroke": "#2e8b5766", "width": 1},
            ),
            "bands": ({"series": (3, 4), "fill": "#2e8b5733"},),
            "title": f"{name} [{self._units[joint]}]",
            **_axes(),
        }


def _axes() -> dict[str, Any]:
    return {
        "height": _HEIGHT,
        "scales": {"x": {"time": False}},
        "axes": ({"show": True}, {"show": True, "size": 55}),
    }


def _dropdown(gui: Any, label: str, options: Sequence[str], first: str) -> Any:
    return gui.add_dropdown(label, tuple(options), initial_value=first, visible=len(options) > 1)


def _set_scene(server: Any) -> None:
    scene = server.scene
    scene.set_up_direction("+z")
    scene.add_grid("/floor", width=4.0, height=4.0, position=(0.0, 0.0, -0.93))
    server.initial_camera.position = (2.3, 0.9, 1.0)
    server.initial_camera.look_at = (0.35, 0.0, 0.0)
