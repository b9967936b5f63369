"""``mapquilt convert``: write maps, logs and runs in other formats."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mapping.io.map_yaml import Mode
from mapping.numbers import parse_angle
from mapquilt.cli.exit_status import ALL_MERGED
from mapquilt.cli.options.files import Unknown, path, unknown_grey
from mapquilt.cli.tables import print_table, warn
from mapquilt.convert.conversion import Format
from mapquilt.convert.conversion import convert as convert_files
from mapquilt.convert.reframing import Reframing


def convert(
    source: Annotated[
        Path, typer.Argument(metavar="MAP | LOG | RUN", help="A map file, a robot's log.npz, or a run folder.")
    ],
    out: Annotated[
        Path,
        typer.Argument(
            metavar="OUT", parser=path, help="File to write, replaced if there; for a run, a new or empty folder."
        ),
    ],
    to: Annotated[
        Format | None, typer.Option(help="Format; default: by OUT's ending, .yaml, .pgm, .png, .tum or .carmen.")
    ] = None,
    mode: Annotated[Mode | None, typer.Option(help="Interpretation of grey levels; default: trinary.")] = None,
    unknown: Unknown = None,
    yaw: Annotated[
        str | None,
        typer.Option(
            help="Yaw of the map's origin [rad, or such as 90deg]; 0 bakes it into the picture.", metavar="YAW"
        ),
    ] = None,
    align_walls: Annotated[
        bool, typer.Option("--align-walls", help="Turn the picture so that most walls run along its sides.")
    ] = False,
    resolution: Annotated[float | None, typer.Option(help="Cell size of the new map [m].")] = None,
    crop: Annotated[bool, typer.Option("--crop", help="Keep only the bounding box of the known cells.")] = False,
) -> int:
    """Write a map, a log or a run for other programs.

    A map becomes a map, on another raster if --yaw, --align-walls, --resolution or --crop ask for one; its metres stay
    what they are. A log becomes a TUM trajectory or a CARMEN log. A run becomes a folder: of TUM trajectories
    (odometry and truth), of CARMEN logs with the true poses, or a ROS 2 bag (needs `pip install mapquilt[ros]`). The
    bag holds scans, odometry, tf, maps and the true poses of each robot, but no transform from map to odom, because the
    mapper that runs on it publishes that.

    Example: mapquilt convert runs/office office_bag --to rosbag
    """
    angle = None if yaw is None else _angle(yaw)
    reframing = Reframing(angle, align_walls, resolution, crop)
    conversion = convert_files(source, out, to, mode, unknown_grey(unknown), reframing)
    warn(conversion.warnings)
    print_table(conversion.summary)
    return ALL_MERGED


def _angle(text: str) -> float:
    try:
        return parse_angle(text)
    except ValueError:
        raise ValueError(f"--yaw {text}: must be an angle [rad], or one in degrees such as 90deg") from None
