import dataclasses
import json
import math
import os

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.grid.pixel_matrix import pixel_matrix
from mapping.map_set import MapSet
from merge import MergeSettings, ScaleRange, merge_maps
from merge.pair.pipeline import _at_another_scale
from merge.pair.task import PairTask
from merge.preparation.settings import PreparationSettings
from merge.records.verdict import Reason
from merge.verification.settings import AcceptanceSettings
from tests.merge.rooms import (
    CELL,
    World,
    cave,
    corridor,
    equal_rooms,
    hall,
    observed,
    random_similarity,
    rooms,
    viewpoints,
)

QUILT = MergeSettings(method="quilt")
WIDTH, HEIGHT = 16.0, 11.0
PARTS = [((0.3, 0.3), (11.0, 10.7)), ((4.5, 0.3), (15.7, 10.7)), ((2.0, 0.3), (14.0, 10.7))]


def quilted(maps, settings=QUILT, **options):
    return merge_maps(maps, settings, **options)


def team(seed, number=2, scale=(1.0, 1.0), honest=True):
    """Maps of one world, and the true map_from_world of each; stated cell sizes are true, or all equal."""
    rng = np.random.default_rng(seed)
    world = rooms(rng, WIDTH, HEIGHT)
    frames = [random_similarity(rng, scale if k else (1.0, 1.0)) for k in range(number)]
    grids = []
    for frame, part in zip(frames, PARTS[:number], strict=True):
        points = viewpoints(world, rng, *part, number=25)
        grids.append(observed(world, points, frame, rng, CELL if honest else CELL * frame.scale, noise=0.01))
    return map_set(grids, honest and scale == (1.0, 1.0)), frames


def map_set(grids, trusted=True, unit="m"):
    return MapSet(tuple("abcdefg"[: len(grids)]), tuple(grids), (unit,) * len(grids), trusted)


def off_cells(found, truth, source):
    """Mean displacement of the source's walls, in cells of the source."""
    points = source.frame.metres_from_cells(np.argwhere(source.occupied))
    apart = np.hypot(*(found.apply(points) - truth.apply(points)).T).mean()
    return apart / (truth.scale * source.frame.resolution)


@pytest.fixture(scope="module")
def known():
    maps, frames = team(3)
    return maps, frames, quilted(maps)


@pytest.mark.slow
def test_known_transforms_are_found_within_half_a_cell():
    errors = []
    for seed, scale, honest in [
        (0, (1, 1), True),
        (1, (0.5, 2.0), True),
        (4, (0.5, 2.0), False),
        (5, (0.5, 2.0), True),
    ]:
        maps, frames = team(seed, 2, scale, honest)
        pair = quilted(maps).pairs[0]
        assert pair.accepted, (seed, pair.reason)
        errors.append(off_cells(pair.target_from_source, frames[0] @ frames[1].inverse(), maps.grids[1]))
    assert np.median(errors) < 0.5
    assert max(errors) < 1.0


@pytest.mark.slow
def test_sift_finds_copies():
    maps, frames = team(0)
    pair = merge_maps(maps, MergeSettings(method="sift")).pairs[0]
    assert pair.accepted, pair.reason
    assert off_cells(pair.target_from_source, frames[0] @ frames[1].inverse(), maps.grids[1]) < 1.0


@pytest.mark.slow
def test_a_transformed_copy_of_a_map_is_found():
    maps, _ = team(3)
    grid = maps.grids[0]
    copy_from_grid = Similarity2(7.0, -3.0, 1.2, 1.5)
    corners = copy_from_grid.apply(
        grid.frame.metres_from_cells(
            [(-0.5, -0.5), (-0.5, grid.frame.shape[1]), (grid.frame.shape[0], -0.5), grid.frame.shape]
        )
    )
    low, high = corners.min(axis=0), corners.max(axis=0)
    shape = tuple(int(n) for n in np.ceil((high - low) / CELL)[::-1])
    frame = GridFrame(CELL, SE2(*low), shape)
    cells = np.indices(shape).reshape(2, -1).T
    looked_up = grid.frame.cells_from_metres(copy_from_grid.inverse().apply(frame.metres_from_cells(cells)))
    inside = grid.frame.contains(looked_up)
    values = np.zeros(len(cells), dtype=np.float32)
    values[inside] = grid.log_odds[tuple(looked_up[inside].T)]
    copy = OccupancyGrid(frame, values.reshape(shape))
    pair = quilted(map_set((copy, grid), trusted=False)).pairs[0]
    assert pair.accepted
    assert off_cells(pair.target_from_source, copy_from_grid, grid) < 0.5
    assert pair.target_from_source.scale == pytest.approx(1.5, rel=2e-3)

    for grids, scale in (((copy, grid), ScaleRange(1.2, 1.8)), ((grid, copy), ScaleRange(1 / 1.8, 1 / 1.2))):
        found = quilted(map_set(grids, trusted=False), MergeSettings("quilt", scale=scale)).pairs[0]
        assert found.accepted
        assert scale.low <= found.target_from_source.scale <= scale.high


def test_the_pixel_matrix_agrees_with_the_metric_answer(known):
    maps, _, result = known
    pair = result.pairs[0]
    expected = pixel_matrix(maps.grids[0].frame, pair.target_from_source, maps.grids[1].frame)
    np.testing.assert_allclose(pair.target_from_source_pixels, expected, atol=1e-6)
    angle = math.atan2(pair.target_from_source_pixels[1, 0], pair.target_from_source_pixels[0, 0])
    assert angle == pytest.approx(-pair.target_from_source.yaw)


def test_stating_half_the_cell_size_doubles_the_scale_but_leaves_the_pixels(known):
    maps, _, result = known
    frame = dataclasses.replace(maps.grids[1].frame, resolution=CELL / 2)
    halved = map_set((maps.grids[0], OccupancyGrid(frame, maps.grids[1].log_odds)), trusted=False)
    pair = quilted(halved, MergeSettings("quilt", scale=ScaleRange(2.0, 2.0))).pairs[0]
    before = result.pairs[0]
    assert pair.accepted
    assert pair.target_from_source.scale == pytest.approx(2.0)
    np.testing.assert_allclose(pair.target_from_source_pixels, before.target_from_source_pixels, atol=1e-6)


def test_maps_that_fit_at_the_stated_scale_fit_at_no_other(known):
    maps, _, result = known
    assert result.pairs[0].accepted
    task = PairTask.of(maps, 0, 1, ScaleRange.known(), QUILT, 0)
    assert _at_another_scale(task, task.features(None)) is None


def test_maps_that_fit_only_at_another_scale_are_refused_with_that_reason(known):
    maps, _, result = known
    frame = dataclasses.replace(maps.grids[1].frame, resolution=CELL / 1.6)
    pair = quilted(map_set((maps.grids[0], OccupancyGrid(frame, maps.grids[1].log_odds)))).pairs[0]
    assert not pair.accepted and pair.confidence == 0.0
    assert pair.reason is Reason.OTHER_SCALE and pair.reason_text.endswith(", 1.6 times that")
    np.testing.assert_allclose(
        pair.target_from_source_pixels, result.pairs[0].target_from_source_pixels, rtol=5e-3, atol=2.0
    )


def test_shifting_an_origin_leaves_the_pixels_and_moves_the_metric_answer_by_as_much(known):
    maps, _, result = known
    moves = (SE2(100.0, -40.0, 0.7), SE2(-7.0, 3.0, -2.0))
    grids = [
        OccupancyGrid(dataclasses.replace(grid.frame, origin=move @ grid.frame.origin), grid.log_odds)
        for grid, move in zip(maps.grids, moves, strict=True)
    ]
    pair, before = quilted(map_set(grids)).pairs[0], result.pairs[0]
    np.testing.assert_array_equal(pair.target_from_source_pixels, before.target_from_source_pixels)
    target_move, source_move = (Similarity2.from_se2(move) for move in moves)
    expected = target_move @ before.target_from_source @ source_move.inverse()
    np.testing.assert_allclose(pair.target_from_source.matrix(), expected.matrix(), atol=1e-9)


def test_swapping_the_maps_gives_the_inverse_and_the_same_evidence(known):
    maps, _, result = known
    there, back = result.pairs[0], quilted(map_set(maps.grids[::-1])).pairs[0]
    np.testing.assert_allclose(back.target_from_source.matrix(), there.target_from_source.inverse().matrix(), atol=1e-9)
    assert dataclasses.asdict(back.evidence) == pytest.approx(dataclasses.asdict(there.evidence))
    assert back.confidence == there.confidence


@pytest.mark.slow
def test_three_maps_in_one_frame_agree_with_the_truth():
    maps, frames = team(8, 3)
    ticks = []
    result = quilted(maps, on_progress=lambda done, total: ticks.append((done, total)))
    assert ticks == [(1, 3), (2, 3), (3, 3)]
    assert [(pair.target, pair.source) for pair in result.pairs] == [("a", "b"), ("a", "c"), ("b", "c")]
    assert set(result.reference_from_map) == {"a", "b", "c"}
    reference = frames["abc".index(result.reference)]
    for name, frame, grid in zip("abc", frames, maps.grids, strict=True):
        assert off_cells(result.reference_from_map[name], reference @ frame.inverse(), grid) < 1.0
    assert result.merged.known.sum() > 1.1 * max(grid.known.sum() for grid in maps.grids)


def test_the_same_seed_gives_the_same_numbers_to_the_last_bit(known):
    maps, _, result = known
    again = quilted(maps)
    assert again.pairs[0].target_from_source == result.pairs[0].target_from_source
    assert again.pairs[0].evidence == result.pairs[0].evidence
    assert again.merged.log_odds.tobytes() == result.merged.log_odds.tobytes()


@pytest.mark.parametrize("units", [("cell", "m"), ("m", "cell")])
def test_an_answer_is_in_the_unit_of_its_target(units):
    bare = OccupancyGrid.from_occupancy(GridFrame(1.0, SE2(), (3, 3)), np.zeros((3, 3)))
    (pair,) = merge_maps(MapSet(("a", "b"), (bare, bare), units)).pairs
    assert pair.unit == units[0]


@pytest.mark.slow
def test_the_seed_is_that_of_the_random_samples():
    maps, _ = team(0)
    found = {merge_maps(maps, MergeSettings(method="sift"), seed=seed).pairs[0].evidence for seed in range(3)}
    assert len(found) > 1
    with pytest.raises(ValueError, match="seed is -1"):
        merge_maps(maps, MergeSettings(method="sift"), seed=-1)


def test_evidence_is_plain_numbers(known):
    record = dataclasses.asdict(known[2].pairs[0].evidence)
    assert json.loads(json.dumps(record, allow_nan=False)) == record


def test_the_merger_reads_no_file(known, monkeypatch):
    maps, _, result = known

    def refuse(*arguments, **options):
        raise AssertionError(f"the merger opened {arguments}")

    monkeypatch.setattr("builtins.open", refuse)
    monkeypatch.setattr(os, "open", refuse)
    assert quilted(maps).pairs[0].target_from_source == result.pairs[0].target_from_source


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1, 3])
def test_maps_of_two_places_are_refused_with_a_reason(seed):
    first, second = team(100 + seed)[0].grids[0], team(200 + seed)[0].grids[1]
    result = quilted(map_set((first, second), trusted=False))
    pair = result.pairs[0]
    assert not pair.accepted and pair.reason and pair.confidence < 0.5
    assert len(result.left_out) == 1
    assert (pair.target_from_source is None) == (pair.evidence is None)
    alone = first if result.reference == "a" else second
    np.testing.assert_array_equal(result.merged.log_odds, alone.cropped().log_odds)


def bare(values):
    values = np.asarray(values)
    return OccupancyGrid.from_occupancy(GridFrame(1.0, SE2(), values.shape), values)


def wall():
    values = np.zeros((60, 200), dtype=int)
    values[:3] = 100
    return values


@pytest.mark.parametrize(
    "values",
    [
        wall(),
        np.full((50, 50), -1),
        np.zeros((50, 50)),
        np.full((50, 50), 100),
        [[0]],
        [[100]],
        [[100, 0, -1], [0, 0, 0]],
    ],
    ids=["one wall", "unknown", "free", "occupied", "free cell", "occupied cell", "two by three"],
)
def test_a_map_with_too_little_structure_is_refused(values, known):
    for other in (bare(values), known[0].grids[0]):
        for grids in ((bare(values), other), (other, bare(values))):
            pair = quilted(map_set(grids, unit="cell")).pairs[0]
            assert not pair.accepted
            assert pair.reason in (
                Reason.LITTLE_STRUCTURE,
                Reason.PARALLEL_WALLS,
                Reason.NOTHING_PROPOSED,
                Reason.FREE_SPACE_VIOLATION,
                Reason.LITTLE_OVERLAP,
            )


@pytest.mark.slow
def test_noise_is_refused():
    rng = np.random.default_rng(0)
    grids = [bare(rng.choice([100, 0, -1], (120, 160))) for _ in range(2)]
    assert not quilted(map_set(grids, unit="cell")).pairs[0].accepted


def two_maps(world, seed, parts, number=30):
    rng = np.random.default_rng(seed)
    frames = [random_similarity(rng) for _ in parts]
    grids = [
        observed(world, viewpoints(world, rng, *part, number=number), frame, rng, noise=0.01)
        for frame, part in zip(frames, parts, strict=True)
    ]
    return map_set(grids), frames[0] @ frames[1].inverse()


def mirrored(grid):
    """Turn the picture of a map over; its frame stays."""
    return OccupancyGrid(grid.frame, grid.log_odds[:, ::-1])


@pytest.mark.slow
@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
@pytest.mark.parametrize("trusted", [True, False])
def test_a_mirrored_map_is_refused_and_named(order, trusted):
    maps, _ = team(3)
    grids = maps.grids[0], mirrored(maps.grids[1])
    pair = quilted(MapSet(("a", "b"), tuple(grids[k] for k in order), ("m", "m"), trusted)).pairs[0]
    assert (pair.accepted, pair.reason) == (False, Reason.MIRRORED)


@pytest.mark.slow
def test_a_place_that_is_its_own_mirror_image_is_not_called_mirrored():
    """Both answers are as good mirrored as not; a quarter of the hall tells nothing else."""
    half = hall().walls
    world = World(half | half[:, ::-1])
    maps, _ = two_maps(world, 0, [((0.3, 0.3), (13.7, 8.7))] * 2)
    pair = quilted(maps).pairs[0]
    assert (pair.accepted, pair.reason) == (False, Reason.SYMMETRIC)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scale", "says"), [(ScaleRange(0.8, 1.25), ", 0.8 to 1.25: 1.7"), (ScaleRange.known(), ", 1: 1.7")]
)
def test_a_scale_outside_of_the_searched_range_is_named(scale, says):
    maps, _ = team(3)
    grid = maps.grids[1]
    frame = GridFrame(grid.frame.resolution / 1.7, grid.frame.origin, grid.frame.shape)
    two = MapSet(("a", "b"), (maps.grids[0], OccupancyGrid(frame, grid.log_odds)), ("m", "m"))
    pair = merge_maps(two, MergeSettings(scale=scale)).pairs[0]
    assert (pair.accepted, pair.reason) == (False, Reason.OUTSIDE_SCALES)
    assert says in pair.reason_text
    assert pair.target_from_source.scale == pytest.approx(1.7, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1])
def test_equal_rooms_are_refused_as_ambiguous(seed):
    maps, _ = two_maps(equal_rooms(), seed, (((0.3, 0.3), (14.4, 11.7)), ((9.6, 0.3), (23.7, 11.7))))
    pair = quilted(maps).pairs[0]
    assert not pair.accepted
    assert pair.reason in (Reason.AMBIGUOUS, Reason.SYMMETRIC)  # two equal rooms are turned into each other, too
    assert pair.evidence.wall_inlier_ratio > 0.8  # nothing else would have refused it


@pytest.mark.slow
@pytest.mark.parametrize("scale", [ScaleRange.known(), ScaleRange.free()])
def test_a_symmetric_hall_is_refused_as_such(scale):
    maps, _ = two_maps(hall(), 0, [((0.3, 0.3), (13.7, 8.7))] * 2)
    pair = quilted(maps, MergeSettings("quilt", scale=scale)).pairs[0]
    assert (pair.accepted, pair.reason) == (False, Reason.SYMMETRIC)
    assert pair.evidence.score > 0.8  # nothing else would have refused it


@pytest.mark.slow
def test_the_alternatives_of_a_symmetric_hall_include_half_a_turn():
    maps, truth = two_maps(hall(), 0, [((0.3, 0.3), (13.7, 8.7))] * 2)
    pair = quilted(maps).pairs[0]
    places = [pair.target_from_source, *(other.target_from_source for other in pair.alternatives)]
    off = [off_cells(place, truth, maps.grids[1]) for place in places]
    turned = [math.degrees(abs(math.remainder(place.yaw - truth.yaw, math.tau))) for place in places]
    assert min(off) < 2.0
    assert max(turned[:2]) > 175.0
    scores = [other.score for other in pair.alternatives]
    assert scores == sorted(scores, reverse=True)
    assert pair.evidence.second_best_score == scores[0]


def test_min_confidence_decides_acceptance(known):
    maps, _, result = known
    sure = result.pairs[0].confidence
    for least, accepted in ((sure, True), (math.nextafter(sure, 1.0), sure == 1.0)):
        acceptance = AcceptanceSettings(min_confidence=least)
        assert quilted(maps, MergeSettings("quilt", acceptance=acceptance)).pairs[0].accepted is accepted


def test_a_bare_corridor_is_refused_for_parallel_walls():
    maps, _ = two_maps(corridor(), 1, [((8.0, 0.5), (20.0, 2.2)), ((14.0, 0.5), (30.0, 2.2))])
    pair = quilted(maps).pairs[0]
    assert (pair.accepted, pair.reason) == (False, Reason.PARALLEL_WALLS)


@pytest.mark.parametrize("seed", [0, 1])
def test_caves_without_a_straight_wall_are_merged(seed):
    world = cave(np.random.default_rng(seed))
    maps, truth = two_maps(world, seed, PARTS[:2])
    pair = quilted(maps).pairs[0]
    assert pair.accepted, pair.reason
    assert off_cells(pair.target_from_source, truth, maps.grids[1]) < 1.0


def test_one_map_alone_is_its_own_merge(known):
    grid = known[0].grids[0]
    result = quilted(map_set((grid,)))
    assert (result.pairs, result.reference) == ((), "a")
    np.testing.assert_array_equal(result.merged.log_odds, grid.cropped().log_odds)
    assert result.merged.frame == grid.cropped().frame


def test_unknown_cells_around_a_map_change_nothing(known):
    """A map in a larger raster gives the same answer."""
    maps, _, before = known
    wide = [np.pad(grid.log_odds, ((700, 3), (0, 900))) for grid in maps.grids]
    frames = [grid.frame.window((-700, 0), log_odds.shape) for grid, log_odds in zip(maps.grids, wide, strict=True)]
    result = quilted(map_set([OccupancyGrid(f, w) for f, w in zip(frames, wide, strict=True)]))
    assert result.pairs[0].evidence == before.pairs[0].evidence
    assert result.merged.frame.shape == before.merged.frame.shape
    np.testing.assert_allclose(
        result.pairs[0].target_from_source.matrix(), before.pairs[0].target_from_source.matrix(), atol=1e-9
    )


@pytest.mark.parametrize("most", [20_000, 60_000])
def test_large_maps_are_matched_in_coarser_cells(most):
    maps, frames = team(5, scale=(0.7, 0.7), honest=False)
    settings = MergeSettings(preparation=PreparationSettings(max_cells=most))
    pair = quilted(maps, settings).pairs[0]
    assert pair.accepted, pair.reason
    assert off_cells(pair.target_from_source, frames[0] @ frames[1].inverse(), maps.grids[1]) < 1.5
    np.testing.assert_allclose(
        pixel_matrix(maps.grids[0].frame, pair.target_from_source, maps.grids[1].frame),
        pair.target_from_source_pixels,
        atol=1e-9,
    )
