"""Colours: one a hypothesis, and the usual ones told apart by people who see few hues."""

import itertools

import numpy as np
import pytest
import recorder_fake_run as fake

from base_station.recording.palette import Rgb, hypothesis_color, vehicle_color
from base_station.recording.scene import hypotheses, usual

# Machado, Oliveira and Fernandes 2009, severity 1: what is left of linear RGB
SIGHTS = {
    "full": np.eye(3),
    "protanopia": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216],
         [-0.003882, -0.048116, 1.051998]]),
    "deuteranopia": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413],
         [-0.011820, 0.042940, 0.968881]]),
    "tritanopia": np.array(
        [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602],
         [0.004733, 0.691367, 0.303900]]),
}  # fmt: skip
XYZ = np.array(
    [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
)  # of linear sRGB
TOLD_APART = 10.0  # CIE 1976 colour difference; 2.3 is just noticeable side by side


def seen(color: Rgb, sight: str) -> np.ndarray:
    """CIELAB of a colour as it is seen."""
    value = np.array(color) / 255.0
    linear = np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)
    xyz = XYZ @ np.clip(SIGHTS[sight] @ linear, 0.0, 1.0) / XYZ.sum(axis=1)
    f = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16.0 / 116.0)
    return np.array([116.0 * f[1] - 16.0, 500.0 * (f[0] - f[1]), 200.0 * (f[1] - f[2])])


def apart(a: Rgb, b: Rgb, sight: str) -> float:
    return float(np.linalg.norm(seen(a, sight) - seen(b, sight)))


def test_every_hypothesis_has_a_colour_of_its_own_and_no_vehicle_shares_it() -> None:
    colors = [hypothesis_color(name) for name in hypotheses(fake.view())]
    colors += [vehicle_color(k) for k in range(3)]
    for a, b in itertools.combinations(colors, 2):
        assert apart(a, b, "full") > TOLD_APART


@pytest.mark.parametrize("sight", SIGHTS)
def test_the_usual_hypotheses_are_told_apart_by_everybody(sight: str) -> None:
    names = usual(fake.view())
    assert len(names) == 6
    for a, b in itertools.combinations(names, 2):
        difference = apart(hypothesis_color(a), hypothesis_color(b), sight)
        assert difference > TOLD_APART, (a, b)


def test_what_is_not_known_has_a_colour_too_always_the_same() -> None:
    assert hypothesis_color("gyro_upside_down") == hypothesis_color("gyro_upside_down")
