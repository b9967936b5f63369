"""Picture of the map of a log: with its path, and the keyframes and loops of its pose graph."""

from __future__ import annotations

from typing import Any

from mapping.wording import counted
from mapquilt.evaluation.trajectory_error import Spread
from mapquilt.logs.log_map import LogMap


def map_figure(drawn: LogMap) -> Any:
    """Draw the map of a log, with the path, the keyframes and the loops of its pose graph, and the reference."""
    from mapquilt.viz.log_map_picture import log_map_figure

    result, error = drawn.result, drawn.error
    reference = None
    if error is not None:
        reference = error.reference_from_estimate.inverse().apply(error.reference[:, :2])
    return log_map_figure(
        name=drawn.name,
        details=_details(drawn),
        grid=drawn.grid,
        path=result.trajectory.poses[:, :2],
        keyframes=result.keyframes,
        loops=[(int(result.keyframes[edge.first]), int(result.keyframes[edge.second])) for edge in result.loops],
        reference=reference,
    )


def _details(drawn: LogMap) -> str:
    trajectory = drawn.result.trajectory
    duration = float(trajectory.stamps[-1] - trajectory.stamps[0])
    driven = f"{counted(len(trajectory), 'scan')} in {duration:.0f} s, {trajectory.distance():.0f} m driven"
    text, error = f"{driven}, poses: {drawn.poses}", drawn.error
    return text if error is None else f"{text}; {Spread.of(error.position).rmse:.3f} m RMSE off the reference"
