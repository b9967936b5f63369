import math

import numpy as np
import pytest

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from merge.alignment.deduplication import rms_displacement
from merge.alignment.icp import icp_batch
from merge.alignment.settings import IcpSettings
from merge.preparation.prepared_map import PreparedMap
from tests.merge.rooms import cave, rooms, two_prepared_maps

GATES = np.geomspace(20.0, 3.0, 8)
FREE = ScaleRange.free()


@pytest.fixture(scope="module", params=[rooms, cave], ids=["rooms", "cave"])
def maps(request):
    return two_prepared_maps(request.param, 3, Similarity2(3.0, 1.0, -0.7, 1.4))


def displaced(truth, source, shift, turn_deg, growth):
    """The truth moved, turned and grown about where it lays the middle of the source."""
    middle, spin = truth.apply(source.middle), Similarity2(yaw=math.radians(turn_deg), scale=growth)
    offset = middle + np.array(shift) - spin.apply(middle)
    return Similarity2(*offset.tolist(), spin.yaw, growth) @ truth


def starts(truth, source, number=12):
    rng = np.random.default_rng(5)
    return [
        displaced(truth, source, rng.uniform(-8.0, 8.0, 2), rng.uniform(-4.0, 4.0), rng.uniform(0.95, 1.05))
        for _ in range(number)
    ]


def test_starts_nearby_all_end_at_the_truth(maps):
    target, source, truth = maps
    begun = starts(truth, source)
    ended = icp_batch(target, source, begun, np.tile(GATES, (len(begun), 1)), FREE, 200)
    off = rms_displacement(source, [truth, *ended])[0, 1:]
    assert np.median(rms_displacement(source, [truth, *begun])[0, 1:]) > 5.0
    assert np.quantile(off, 0.75) < 1.0  # cells


def test_each_start_is_refined_independently(maps):
    target, source, truth = maps
    begun = starts(truth, source, 4)
    gates = GATES * np.array([[1.0], [0.5], [2.0], [0.1]])
    together = icp_batch(target, source, begun, gates, FREE, 150)
    alone = [icp_batch(target, source, [start], gates[k : k + 1], FREE, 150)[0] for k, start in enumerate(begun)]
    assert together == alone


def test_a_step_is_that_of_the_normal_equations_written_out(maps):
    """Against plain sums over all pairs of points: nearest that faces the same sector, Tukey's weight."""
    target, source, truth = maps
    start, gate = displaced(truth, source, (2.0, -1.0), 1.0, 1.01), 6.0
    hessian, gradient = np.zeros((4, 4)), np.zeros(4)
    centre = start.apply(source.middle)

    def sectors(normals):
        axes = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
        return normals @ axes.T

    def add(place, error, normal, weight):
        arm = place - centre
        moves = np.array([[1.0, 0.0, -arm[1], arm[0]], [0.0, 1.0, arm[0], arm[1]]])
        weigh = IcpSettings.line_weight * np.outer(normal, normal) + (1.0 - IcpSettings.line_weight) * np.eye(2)
        hessian[:] += weight * moves.T @ weigh @ moves
        gradient[:] += weight * moves.T @ weigh @ error

    turned = Similarity2(yaw=start.yaw).apply(source.normals)
    moved_points = start.apply(source.points)
    for here, facing in zip(moved_points, turned, strict=True):
        for index, distance in nearest(target, here, facing, sectors):
            if distance < gate:
                weight = (1.0 - (distance / gate) ** 2) ** 2 * max(alike(facing, target.normals[index]), 0.0)
                add(here, target.points[index] - here, target.normals[index], start.scale * weight)
    back = start.inverse()
    unturned = Similarity2(yaw=back.yaw).apply(target.normals)
    for there, facing, own in zip(target.points, unturned, target.normals, strict=True):
        for index, distance in nearest(source, back.apply(there), facing, sectors):
            if distance < gate / start.scale:
                reach = distance * start.scale / gate
                weight = (1.0 - reach**2) ** 2 * max(alike(turned[index], own), 0.0)
                add(moved_points[index], there - moved_points[index], turned[index], weight)
    x, y, turn, growth = np.linalg.solve(hessian, gradient)
    expected = displaced(start, source, (x, y), math.degrees(turn), math.exp(growth))
    (found,) = icp_batch(target, source, [start], np.array([[gate]]), FREE, 10**6)
    assert rms_displacement(source, [expected, found])[0, 1] < 0.05 * rms_displacement(source, [expected, start])[0, 1]


def alike(one, other):
    return 1.0 if not one.any() or not other.any() else float(one @ other)


def nearest(prepared, point, facing, sectors):
    """Find the surface point nearest to this one among those that face its sector; a list of one, or empty."""
    wanted = sectors(prepared.normals)[:, int(np.argmax(sectors(facing[None])[0]))] > 0.38
    members = (
        np.flatnonzero(wanted | ~prepared.normals.any(axis=1)) if facing.any() else np.arange(len(prepared.points))
    )
    if not len(members):
        return []
    cell = np.floor(point) + 0.5
    best = members[int(np.argmin(np.hypot(*(prepared.points[members] - cell).T)))]
    return [(best, float(np.hypot(*(prepared.points[best] - point))))]


def test_a_known_scale_is_kept_and_a_bound_not_passed(maps):
    target, source, truth = maps
    start = displaced(truth, source, (4.0, 3.0), 2.0, 1.03)
    (known,) = icp_batch(target, source, [start], GATES[None], ScaleRange(start.scale, start.scale), 200)
    assert known.scale == pytest.approx(start.scale, rel=1e-12)
    low = 1.01 * truth.scale
    (bounded,) = icp_batch(target, source, [start], GATES[None], ScaleRange(low, 2.0), 200)
    assert bounded.scale == pytest.approx(low, rel=1e-3)


def test_a_start_without_correspondences_is_returned(maps):
    target, source, truth = maps
    far = Similarity2(1e6, 0.0, 1.0, truth.scale)
    assert rms_displacement(source, [far, *icp_batch(target, source, [far], GATES[None], FREE, 200)])[0, 1] < 1e-6
    blank = PreparedMap(type(target.grid)(target.grid.frame, np.zeros_like(target.grid.log_odds)))
    assert icp_batch(target, blank, [truth], GATES[None], FREE, 200) == [truth]
    assert icp_batch(target, source, [], np.empty((0, 8)), FREE, 200) == []
