"""Conversion of colours: from sRGB to linear light, to bytes, and to four components."""

import numpy as np

from service.encoders.content import add_opacity, is_translucent, to_bytes
from service.engine.scenes.colors import to_linear

LINEAR = {
    0x00: 0.0,
    0x01: 0.00030352698354883749,
    0x0A: 0.0030352698354883749,
    0x0B: 0.0033465357638991585,
    0x80: 0.21586050011389918,
    0xBC: 0.50288645803256839,
    0xFF: 1.0,
}
"""Linear light of some bytes of sRGB, computed by the formula of IEC 61966-2-1 with 40 digits."""


def test_linear_light_agrees_with_the_standard() -> None:
    srgb = np.repeat(np.array(list(LINEAR)) / 255, 3).reshape(-1, 3)
    np.testing.assert_allclose(to_linear(srgb)[:, 1], list(LINEAR.values()), rtol=1e-13)


def test_black_and_white_are_exact_and_light_increases_between_them() -> None:
    ramp = np.arange(0, 10_001)[:, np.newaxis].repeat(3, axis=1) / 10_000
    light = to_linear(ramp.astype(np.float32))
    assert (light[0] == 0).all()
    assert (light[-1] == 1).all()
    assert (np.diff(light, axis=0) > 0).all()
    # The two branches of the formula in the standard differ by a share of 7.4e-7 at 0.04045.
    end, begin = to_linear(np.array([[0.04045] * 3, [np.nextafter(0.04045, 1)] * 3]))
    np.testing.assert_allclose(end, begin, rtol=1e-6)


def test_opacity_stays_unchanged() -> None:
    colors = np.array([[0.5, 0.5, 0.5, 0.5]])
    assert to_linear(colors)[0, 3] == 0.5
    # The array of the caller stays unchanged too.
    assert colors[0, 0] == 0.5


def test_every_byte_is_the_rounded_value_of_its_fraction() -> None:
    rgba = np.arange(256, dtype=np.uint8)[:, np.newaxis].repeat(4, axis=1)
    np.testing.assert_array_equal(to_bytes(rgba / 255), rgba)
    np.testing.assert_array_equal(to_bytes((rgba / 255).astype(np.float32)), rgba)


def test_colours_without_opacity_become_opaque() -> None:
    rgb, rgba = np.array([[0.25, 0.5, 1]]), np.array([[0.25, 0.5, 1, 0.75]])
    assert add_opacity(rgb).tolist() == [[0.25, 0.5, 1, 1]]
    assert add_opacity(rgba).tolist() == rgba.tolist()
    assert is_translucent(rgba)
    assert not is_translucent(rgb)
    assert not is_translucent(add_opacity(rgb))
