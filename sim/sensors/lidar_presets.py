"""List lidar models with their field of view, noise and sources."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from mapping.geometry.se2 import SE2
from mapping.wording import did_you_mean
from sim.sensors.lidar import Lidar
from sim.sensors.range_noise import RangeNoise

AHEAD = SE2(0.1, 0.0, 0.0)
"""Mounting pose of a lidar without a full view: on the front half of the robot, looking forward."""

_BIN = 1.0 / math.sqrt(12.0)
"""Standard deviation of a uniform rounding error, in steps."""
_LIMIT = 1.0 / 3.0
"""Convert a data sheet's "+- x" without a stated deviation: read as three standard deviations, as in Gazebo's Hokuyo
models."""


@dataclass(frozen=True)
class LidarPreset:
    """Hold a ``lidar``, its ``noise`` at level 1, and one line of ``sources`` per group of numbers."""

    name: str
    lidar: Lidar
    noise: RangeNoise
    sources: tuple[str, ...]


def lidar_preset(name: str) -> LidarPreset:
    """Return the preset of that name. Raises ``ValueError`` with all known names if there is none."""
    for preset in PRESETS:
        if preset.name == name:
            return preset
    known = [preset.name for preset in PRESETS]
    raise ValueError(f"lidar {name!r} is unknown; known are {', '.join(known)}{did_you_mean(name, known)}")


def with_rate(lidar: Lidar, rate: float) -> Lidar:
    """Return the lidar with only ``rate`` scans per second kept. Raises ``ValueError`` if it makes fewer."""
    if not 0.0 < rate <= lidar.rate:
        raise ValueError(f"rate is {rate} Hz, must be positive and at most the {lidar.rate:g} Hz of {lidar.model}")
    return replace(lidar, rate=rate)


def _lidar(
    model: str, beams: int, first_deg: float, step_deg: float, limits: tuple[float, float], rate: float, mount: SE2
) -> Lidar:
    first, step = math.radians(first_deg), math.radians(step_deg)
    return Lidar(beams, first, step, *limits, rate, mount, model)


_TRIANGULATING = RangeNoise(range_sigma=0.0, range_sigma_ratio=0.01, dropout=0.01, short=0.001, random=0.001)
_TIME_OF_FLIGHT = RangeNoise(range_sigma_ratio=0.0, quantum=0.001, dropout=0.002, short=0.0005)
_ASSUMED = "rates of lost, short and random readings: published nowhere, assumed"
_MOUNTED_ON_TOP = "mounted on the robot's axis: assumed"
_MOUNTED_AHEAD = "mounted 0.1 m ahead of the robot's axis: assumed"

PRESETS = (
    LidarPreset(
        "default",
        Lidar(),
        RangeNoise(),
        ("no device: a usual small lidar, 10 mm + 0.5 % and 1 % of readings lost",),
    ),
    LidarPreset(
        "rplidar_a1",
        _lidar("rplidar_a1", 360, -180.0, 1.0, (0.15, 12.0), 5.5, SE2()),
        replace(_TRIANGULATING, quantum=0.00025, angle_sigma=math.radians(1.0) * _BIN),
        (
            "beams, range, rate, 1 %: RPLIDAR A1M8 data sheet (Slamtec 2016), figure 2-1",
            "0.25 mm: dist_mm_q2 of the RPLIDAR SDK",
            "angle: rplidar_ros sorts readings into bins of 1 degree (angle_compensate)",
            _ASSUMED,
            _MOUNTED_ON_TOP,
        ),
    ),
    LidarPreset(
        "rplidar_a2",
        _lidar("rplidar_a2", 1600, -180.0, 0.225, (0.2, 12.0), 10.0, SE2()),
        replace(_TRIANGULATING, quantum=0.00025, angle_sigma=math.radians(0.225) * _BIN),
        (
            "beams, range, rate, 1 %: RPLIDAR A2M12 data sheet (Slamtec), 16,000 readings a second at 10 Hz",
            "0.25 mm: dist_mm_q2 of the RPLIDAR SDK",
            "angle: rplidar_ros sorts readings into bins, here of 0.225 degrees",
            _ASSUMED,
            _MOUNTED_ON_TOP,
        ),
    ),
    LidarPreset(
        "lds01",
        _lidar("lds01", 360, -180.0, 1.0, (0.12, 3.5), 5.0, SE2(-0.032, 0.0, 0.0)),
        replace(_TRIANGULATING, range_sigma_ratio=0.035 * _LIMIT, bias_sigma_ratio=0.05 * _LIMIT, quantum=0.001),
        (
            "beams, range, rate, precision +-3.5 %, accuracy +-5 %: LDS-01, ROBOTIS e-Manual of TurtleBot3",
            "1 mm: hls_lfcd_lds_driver",
            "mounting: scan_joint of turtlebot3_burger.urdf",
            _ASSUMED,
        ),
    ),
    LidarPreset(
        "hokuyo_urg04lx",
        _lidar("hokuyo_urg04lx", 682, (44 - 384) * 360.0 / 1024, 360.0 / 1024, (0.02, 5.6), 10.0, AHEAD),
        replace(_TIME_OF_FLIGHT, range_sigma=0.002, range_sigma_ratio=0.0025),
        (
            "beams 44 to 725 of 1024, front 384, range, rate, 1 mm: SCIP 2.0 specification C-42-03320B (Hokuyo)",
            "noise: +-10 mm to 1 m, +-1 % beyond, Hokuyo's data sheet: a line through thirds of both",
            _ASSUMED,
            _MOUNTED_AHEAD,
        ),
    ),
    LidarPreset(
        "hokuyo_utm30lx",
        _lidar("hokuyo_utm30lx", 1081, -135.0, 0.25, (0.1, 30.0), 40.0, AHEAD),
        replace(_TIME_OF_FLIGHT, range_sigma=0.008, range_sigma_ratio=0.0004),
        (
            "beams 0 to 1080 of 1440, front 540: SCIP 2.0 specification C-42-03320B (Hokuyo)",
            "range, rate, 1 mm: Hokuyo's data sheet",
            "noise: +-30 mm to 10 m, +-50 mm to 30 m, same sheet: a line through thirds of both at 5 and 20 m",
            _ASSUMED,
            _MOUNTED_AHEAD,
        ),
    ),
    LidarPreset(
        "sick_lms1xx",
        _lidar("sick_lms1xx", 541, -135.0, 0.5, (0.01, 20.0), 50.0, AHEAD),
        replace(_TIME_OF_FLIGHT, range_sigma=0.012, bias_sigma=0.03 * _LIMIT),
        (
            "beams, rate: LMS100/111 operating instructions 8012471 (SICK)",
            "range, 1 mm: LMS1xx_node.cpp of the ROS driver lms1xx",
            "12 mm statistical, +-30 mm systematic: support.sick.com, Measurement Errors LMSxxx",
            _ASSUMED,
            _MOUNTED_AHEAD,
        ),
    ),
    LidarPreset(
        "sick_lms200",
        _lidar("sick_lms200", 361, -90.0, 0.5, (0.0, 8.192), 32.0, AHEAD),
        replace(_TIME_OF_FLIGHT, range_sigma=0.005, bias_sigma=0.015 * _LIMIT),
        (
            "beams, rate, 1 mm, 8.192 m: Player's driver sicklms200, resolution 50 at 500 kBd, range_res 1",
            "from 0 m: sicklms.cpp of sicktoolbox_wrapper",
            "5 mm statistical, +-15 mm systematic: LMS 200 technical description (SICK)",
            _ASSUMED,
            _MOUNTED_AHEAD,
        ),
    ),
    LidarPreset(
        "thesis",
        Lidar(1000, -math.pi, 0.006283, 0.2, 5.0, 10.0, SE2(), "thesis"),
        RangeNoise(range_sigma=0.005, range_sigma_ratio=0.0, dropout=0.0),
        (
            "beams, range, 5 mm: Chen (2021), two scanners merged to a full turn",
            "10 Hz: Hokuyo URG-04LX, which its scanners resemble",
            _MOUNTED_ON_TOP,
        ),
    ),
)
"""All presets, the default first."""
