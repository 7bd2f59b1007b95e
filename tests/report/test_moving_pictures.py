from __future__ import annotations

import io

import numpy as np
import pytest
from PIL import Image

from irlpilco_ros.report.moving_pictures import LAST_FRAME_TIME, animation, filmstrip, to_webp
from irlpilco_ros.report.resimulation import Film


def film(count: int, colour: tuple[int, int, int]) -> Film:
    """Pictures of one colour that grows brighter."""
    frames = np.zeros((count, 60, 80, 3), dtype=np.uint8)
    frames[:] = colour
    frames += np.arange(count, dtype=np.uint8)[:, None, None, None]
    return Film(frames, 0.16 * np.arange(float(count)))


def test_animation_runs_in_real_time_and_ends_with_a_pause() -> None:
    data = animation(("left", film(11, (200, 0, 0))), ("right", film(11, (0, 0, 200))))
    image = Image.open(io.BytesIO(data))
    durations = []
    for index in range(getattr(image, "n_frames", 1)):
        image.seek(index)
        image.load()
        durations.append(image.info["duration"])
    assert sum(durations) == pytest.approx(1600 + LAST_FRAME_TIME, abs=20)


def test_films_are_side_by_side() -> None:
    data = animation(("left", film(3, (200, 0, 0))), ("right", film(3, (0, 0, 200))))
    picture = np.asarray(Image.open(io.BytesIO(data)).convert("RGB"), dtype=int)
    left, right = picture[-20, 40], picture[-20, -40]
    assert left[0] > left[2] + 80
    assert right[2] > right[0] + 80


def test_further_films_are_below() -> None:
    colours = ((200, 0, 0), (0, 200, 0), (0, 0, 200), (90, 90, 90))
    data = animation(*((str(colour), film(3, colour)) for colour in colours))
    picture = np.asarray(Image.open(io.BytesIO(data)).convert("RGB"), dtype=int)
    height = picture.shape[0] // 2
    corners = [picture[row, column] for row in (height - 30, -30) for column in (40, -40)]
    np.testing.assert_allclose(corners, colours, atol=25)


def test_shorter_film_ends_both() -> None:
    data = animation(("left", film(5, (200, 0, 0))), ("right", film(3, (0, 0, 200))))
    assert getattr(Image.open(io.BytesIO(data)), "n_frames", 1) == 3


def test_filmstrip_has_both_films_from_start_to_end() -> None:
    strip = filmstrip(("a", film(31, (200, 0, 0))), ("b", film(31, (0, 0, 200))))
    pixels = np.asarray(strip, dtype=int)
    above, below = pixels[150], pixels[-20]
    assert above[20, 0] == 200
    assert above[-20, 0] == 230
    assert below[20, 2] == 200
    assert below[-20, 2] == 230


def test_still_picture_is_webp() -> None:
    assert Image.open(io.BytesIO(to_webp(Image.new("RGB", (8, 8))))).format == "WEBP"
