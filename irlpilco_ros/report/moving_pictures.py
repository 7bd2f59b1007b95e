"""Films side by side: an animation of the whole motion, and a filmstrip of some instants."""

from __future__ import annotations

import io

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from irlpilco_ros.report.resimulation import Film

GAP = 8
"""White between two pictures [pixel]."""
INSTANTS = 6
"""Pictures in a filmstrip."""
STRIP_WIDTH = 260
"""Width of each of them [pixel]."""
LAST_FRAME_TIME = 1500
"""How long the animation stands at its end [ms]."""


def animation(*films: tuple[str, Film]) -> bytes:
    """Return named films, two in a row, in real time, as an animated WebP; the shortest ends it."""
    times = [film.times for _, film in films]
    images = []
    for index in range(min(map(len, times))):
        pictures = [
            _labelled(Image.fromarray(film.frames[index]), name, f"{film.times[index]:.1f} s", 18)
            for name, film in films
        ]
        images.append(_joined([pictures[first : first + 2] for first in range(0, len(films), 2)]))
    step = round(1000 * float(np.diff(times[0]).mean()))
    durations = [step] * (len(images) - 1) + [LAST_FRAME_TIME]
    buffer = io.BytesIO()
    options = {"save_all": True, "append_images": images[1:], "duration": durations, "loop": 0}
    images[0].save(buffer, format="WEBP", quality=72, method=2, **options)
    return buffer.getvalue()


def filmstrip(above: tuple[str, Film], below: tuple[str, Film]) -> Image.Image:
    """Return two named films at the same instants, one above the other."""
    count = min(len(above[1].times), len(below[1].times))
    indices = np.linspace(0, count - 1, INSTANTS).round().astype(int)
    rows = []
    for name, film in (above, below):
        row = []
        for index in indices:
            picture = _scaled(film.frames[index])
            label = name if index == indices[0] else ""
            row.append(_labelled(picture, label, f"{film.times[index]:.1f} s", 15))
        rows.append(row)
    return _joined(rows)


def to_webp(image: Image.Image) -> bytes:
    """Return a picture as WebP."""
    buffer = io.BytesIO()
    image.save(buffer, format="WEBP", quality=82)
    return buffer.getvalue()


def _scaled(frame: NDArray[np.uint8]) -> Image.Image:
    height, width = frame.shape[:2]
    return Image.fromarray(frame).resize((STRIP_WIDTH, round(STRIP_WIDTH * height / width)))


def _labelled(picture: Image.Image, left: str, right: str, size: int) -> Image.Image:
    """Write into the upper corners, white on a dark band that is always there."""
    band = Image.new("RGB", (picture.width, size + 10), "#1c1c1c")
    draw = ImageDraw.Draw(band)
    font = ImageFont.load_default(size)
    draw.text((8, 3), left, fill="white", font=font)
    draw.text((picture.width - 8, 3), right, fill="white", font=font, anchor="ra")
    whole = Image.new("RGB", (picture.width, picture.height + band.height))
    whole.paste(band, (0, 0))
    whole.paste(picture, (0, band.height))
    return whole


def _joined(rows: list[list[Image.Image]]) -> Image.Image:
    """Return pictures of one size as a grid."""
    width, height = rows[0][0].size
    columns = len(rows[0])
    size = (columns * (width + GAP) - GAP, len(rows) * (height + GAP) - GAP)
    whole = Image.new("RGB", size, "white")
    for row, pictures in enumerate(rows):
        for column, picture in enumerate(pictures):
            whole.paste(picture, (column * (width + GAP), row * (height + GAP)))
    return whole
