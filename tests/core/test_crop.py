"""Windows map cells to pixels exactly; the object is the heaviest component."""

from __future__ import annotations

import numpy as np

from core.crop import PADDING_RGB, Window, close_window, largest_component


def test_cell_centres_in_pixels() -> None:
    centres = Window(10, 20, 8).to_pixels(np.array([[0, 0], [3, 1]]), 4)
    assert np.allclose(centres, [[10.5, 20.5], [12.5, 26.5]])


def test_a_cut_shows_what_was_there() -> None:
    image = np.arange(100, dtype=np.float32).reshape(10, 10)
    assert np.allclose(Window(2, 3, 4).cut(image, 4, nearest=True), image[3:7, 2:6])


def test_outside_the_image_colour_is_neutral_and_depth_missing() -> None:
    window = Window(-4, -4, 8)
    assert tuple(window.cut(np.zeros((8, 8, 3), np.uint8), 8)[0, 0]) == PADDING_RGB
    assert window.cut(np.ones((8, 8), np.float32), 8, nearest=True)[0, 0] == 0


def test_paste_undoes_cut_of_the_whole_image() -> None:
    image = np.random.default_rng(0).random((6, 10)).astype(np.float32)
    window = Window.whole(6, 10)
    assert np.allclose(window.paste(np.asarray(window.cut(image, 10)), (6, 10)), image, atol=1e-5)


def test_a_bright_object_beats_a_larger_faint_strip() -> None:
    soft = np.zeros((20, 20))
    soft[0, :] = 0.2
    soft[8:12, 8:12] = 0.9
    found = largest_component(soft, 0.1)
    assert found[10, 10]
    assert not found[0].any()


def test_nothing_above_the_threshold_is_no_object() -> None:
    assert not largest_component(np.full((5, 5), 0.3), 0.5).any()


def test_the_close_window_of_a_speck_in_a_tiny_image_has_a_pixel() -> None:
    component = np.zeros((16, 16), dtype=bool)
    component[8, 8] = True
    window = close_window(component, Window(0, 0, 4), 0.1)
    assert window.size == 1
    assert window.cut(np.ones((4, 4), np.float32), 8).shape == (8, 8)


def test_the_close_window_is_square_centred_and_ten_percent_larger() -> None:
    component = np.zeros((10, 10), dtype=bool)
    component[4:6, 2:8] = True
    assert close_window(component, Window(0, 0, 100), 0.1) == Window(17, 17, 66)
