"""Draws a map of the distances of points in a plane from a surface: docs/distance.png.

    python -m tools.distance_map docs/distance.png

The plane is vertical, parallel to the x axis, and goes through the middle of the surface. Every
pixel is a point whose distance the service computes. Points inside are blue, points outside are
orange. A dark line is drawn where the distance is a multiple of 1/40 of the width of the picture.
"""

import struct
import sys
import zlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from service.engine.closest.project import ProjectQuery, project_on_surface
from service.engine.models import to_patches
from service.surface.examples.catalogue import find

EXAMPLE = "nurbs-goblet"
WIDTH, HEIGHT = 320, 240
BANDS = 40

INSIDE, OUTSIDE = np.array([38.0, 84, 148]), np.array([196.0, 118, 44])
BACKGROUND = np.array([252.0, 250, 246])


def draw_distance_map() -> NDArray[np.uint8]:
    """The picture (HEIGHT, WIDTH, 3)."""
    model = to_patches(find(EXAMPLE).surface().lower())
    low, high = model.bounds
    middle = (low + high) / 2
    picture_height = 1.25 * (high - low).max()  # in units of the model
    # Coordinates of the pixels from the middle of the picture, in heights of the picture.
    x, z = np.meshgrid(
        (np.arange(WIDTH) + 0.5) / HEIGHT - WIDTH / HEIGHT / 2,
        0.5 - (np.arange(HEIGHT) + 0.5) / HEIGHT,
    )
    up_axis = 2 if model.up == "z" else 1
    points = np.tile(middle, (x.size, 1))
    points[:, 0] += picture_height * x.ravel()
    points[:, up_axis] += picture_height * z.ravel()
    columns = project_on_surface(model, ProjectQuery(points, relative_tolerance=1e-4, sign=True))
    distance = columns["distances"] / (picture_height * WIDTH / HEIGHT)  # in widths of the picture
    fading = np.minimum(3 * distance, 0.9)[:, np.newaxis]
    color = np.where(columns["signs"][:, np.newaxis] < 0, INSIDE, OUTSIDE)
    pixels = color + (BACKGROUND - color) * fading
    # Lines are 0.12 of a band wide; the surface itself is almost black.
    is_line = np.abs(distance * BANDS - np.rint(distance * BANDS)) < 0.06
    pixels[is_line] *= 0.82
    pixels[distance < 0.0025] = 20
    picture: NDArray[np.uint8] = pixels.astype(np.uint8).reshape(HEIGHT, WIDTH, 3)
    return picture


def encode_png(pixels: NDArray[np.uint8]) -> bytes:
    """The bytes of a PNG file with these pixels (h, w, 3)."""
    height, width, _ = pixels.shape
    rows = np.zeros((height, 1 + 3 * width), np.uint8)  # each row begins with its filter: none
    rows[:, 1:] = pixels.reshape(height, -1)
    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    parts = (b"IHDR", head), (b"IDAT", zlib.compress(rows.tobytes(), 9)), (b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in parts
    )


if __name__ == "__main__":
    Path(sys.argv[1]).write_bytes(encode_png(draw_distance_map()))
