"""A slow, simple log-odds mapper in exact arithmetic, the oracle of the compiled one."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np

from mapping.geometry.se2 import SE2
from mapping.grid.sensor_model import CountingModel, LogOddsModel, SensorModel, logit
from mapping.robot.scan import LidarScan

Cell = tuple[int, int]


def slow_traverse(x0: float, y0: float, x1: float, y1: float) -> list[Cell]:
    """Amanatides and Woo 1987 step by step, on fractions: cells (row, col) from start to end; corners step in y."""
    start = (Fraction(x0), Fraction(y0))
    run = (Fraction(x1) - start[0], Fraction(y1) - start[1])
    cell = [math.floor(x0), math.floor(y0)]
    last = [math.floor(x1), math.floor(y1)]
    cells = [(cell[1], cell[0])]
    while cell != last:
        crossing = []
        for axis in (0, 1):
            if cell[axis] == last[axis]:
                crossing.append(None)
            else:
                border = cell[axis] + 1 if run[axis] > 0 else cell[axis]
                crossing.append((border - start[axis]) / run[axis])
        t_x, t_y = crossing
        axis = 0 if t_y is None or (t_x is not None and t_x < t_y) else 1
        cell[axis] += 1 if run[axis] > 0 else -1
        cells.append((cell[1], cell[0]))
    return cells


def slow_map(
    scans: list[tuple[LidarScan, SE2]], resolution: float, model: SensorModel, clear_range: float
) -> dict[Cell, float]:
    """Log-odds of every seen cell (row, col counted from the map's origin)."""
    hits: dict[Cell, int] = {}
    visits: dict[Cell, int] = {}
    total: dict[Cell, float] = {}
    for scan, pose in scans:
        hit_cells, crossed = _scan_cells(scan, pose, resolution, min(clear_range, scan.range_max))
        for cell in hit_cells | crossed:
            hit = cell in hit_cells
            hits[cell] = hits.get(cell, 0) + hit
            visits[cell] = visits.get(cell, 0) + 1
            if isinstance(model, LogOddsModel):
                step = logit(model.hit if hit else model.miss)
                total[cell] = min(max(total.get(cell, 0.0) + step, model.low), model.high)
    if isinstance(model, CountingModel):
        return {
            cell: hits[cell] / count - model.threshold for cell, count in visits.items() if count >= model.min_visits
        }
    return total


def _scan_cells(scan: LidarScan, pose: SE2, resolution: float, clear_range: float) -> tuple[set[Cell], set[Cell]]:
    hit_cells: set[Cell] = set()
    crossed: set[Cell] = set()
    for k, reading in enumerate(np.asarray(scan.ranges, np.float64)):
        if reading == -math.inf or (reading == math.inf and clear_range == 0.0):
            continue
        length = clear_range if reading == math.inf else float(reading)
        angle = pose.yaw + scan.angle_min + k * scan.angle_increment
        end = pose.x + length * math.cos(angle), pose.y + length * math.sin(angle)
        cells = slow_traverse(pose.x / resolution, pose.y / resolution, end[0] / resolution, end[1] / resolution)
        crossed.update(cells)
        if reading != math.inf:
            hit_cells.add(cells[-1])
    return hit_cells, crossed
