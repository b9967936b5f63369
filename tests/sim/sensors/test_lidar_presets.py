"""Every preset is a real lidar with its sources."""

from __future__ import annotations

import math
from dataclasses import fields

import numpy as np
import pytest

from sim.sensors.lidar import Lidar
from sim.sensors.lidar_presets import PRESETS, LidarPreset, lidar_preset, with_rate
from sim.sensors.noise import Noise
from sim.sensors.range_noise import RangeNoise

NAMES = [preset.name for preset in PRESETS]


def test_the_presets_are_those_of_the_documentation() -> None:
    documented = "rplidar_a1 rplidar_a2 lds01 hokuyo_urg04lx hokuyo_utm30lx sick_lms1xx sick_lms200 thesis"
    assert ["default", *documented.split()] == NAMES


@pytest.mark.parametrize("preset", PRESETS, ids=NAMES)
def test_a_preset_is_found_by_its_name_which_its_lidar_carries(preset: LidarPreset) -> None:
    assert lidar_preset(preset.name) is preset
    assert preset.lidar.model == preset.name
    assert preset.sources
    assert all(preset.sources)


def test_the_default_is_the_plain_lidar_with_the_plain_noise() -> None:
    assert lidar_preset("default").lidar == Lidar()
    assert Noise.level(1.0, lidar_preset("default").noise) == Noise()


@pytest.mark.parametrize(
    ("name", "beams", "view_deg", "first_deg", "limits", "rate"),
    [
        ("rplidar_a1", 360, 359.0, -180.0, (0.15, 12.0), 5.5),
        ("rplidar_a2", 1600, 359.775, -180.0, (0.2, 12.0), 10.0),
        ("lds01", 360, 359.0, -180.0, (0.12, 3.5), 5.0),
        ("hokuyo_urg04lx", 682, 239.41, -119.53, (0.02, 5.6), 10.0),
        ("hokuyo_utm30lx", 1081, 270.0, -135.0, (0.1, 30.0), 40.0),
        ("sick_lms1xx", 541, 270.0, -135.0, (0.01, 20.0), 50.0),
        ("sick_lms200", 361, 180.0, -90.0, (0.0, 8.192), 32.0),
        ("thesis", 1000, 359.63, -180.0, (0.2, 5.0), 10.0),
    ],
)
def test_the_presets_follow_their_data_sheets(
    name: str, beams: int, view_deg: float, first_deg: float, limits: tuple[float, float], rate: float
) -> None:
    lidar = lidar_preset(name).lidar
    assert lidar.beams == beams
    assert math.degrees(lidar.angles[-1] - lidar.angles[0]) == pytest.approx(view_deg, abs=0.01)
    assert math.degrees(lidar.angle_min) == pytest.approx(first_deg, abs=0.01)
    assert (lidar.range_min, lidar.range_max, lidar.rate) == (*limits, rate)


@pytest.mark.parametrize(
    ("name", "at", "sigma"),
    [
        ("rplidar_a1", 5.0, 0.05),  # 1 %
        ("lds01", 2.0, 0.07 / 3),  # +-3.5 %
        ("hokuyo_urg04lx", 0.5, 0.01 / 3),  # +-10 mm
        ("hokuyo_urg04lx", 3.0, 0.03 / 3),  # +-1 %
        ("hokuyo_utm30lx", 5.0, 0.03 / 3),  # +-30 mm
        ("hokuyo_utm30lx", 20.0, 0.05 / 3),  # +-50 mm
        ("sick_lms1xx", 10.0, 0.012),
        ("sick_lms200", 5.0, 0.005),
        ("thesis", 3.0, 0.005),
    ],
)
def test_the_noise_is_what_the_source_says(name: str, at: float, sigma: float) -> None:
    noise = lidar_preset(name).noise
    assert noise.range_sigma + noise.range_sigma_ratio * at == pytest.approx(sigma, rel=0.06)


def test_the_thesis_sensor_has_gaussian_noise_and_nothing_else() -> None:
    noise = lidar_preset("thesis").noise
    assert noise == RangeNoise(range_sigma=0.005, range_sigma_ratio=0.0, dropout=0.0)
    assert all(getattr(noise, each.name) == 0.0 for each in fields(noise)[2:] if each.name != "short_mean")


def test_the_hokuyos_front_beam_looks_ahead() -> None:
    lidar = lidar_preset("hokuyo_urg04lx").lidar
    assert lidar.angles[384 - 44] == pytest.approx(0.0, abs=1e-12)
    assert np.abs(lidar.angles).max() == pytest.approx(math.radians(119.88), abs=1e-4)


def test_an_unknown_preset_is_refused_with_the_known_ones() -> None:
    with pytest.raises(ValueError, match=r"'velodyne' is unknown; known are default, rplidar_a1, .*thesis"):
        lidar_preset("velodyne")


def test_a_rate_reduces_the_scans_and_cannot_add_any() -> None:
    lidar = lidar_preset("hokuyo_utm30lx").lidar
    assert with_rate(lidar, 5.0).rate == 5.0
    assert with_rate(lidar, 5.0).beams == 1081
    for rate in (0.0, -1.0, 41.0, math.nan):
        with pytest.raises(ValueError, match=f"rate is {rate} Hz.*40 Hz of hokuyo_utm30lx"):
            with_rate(lidar, rate)
