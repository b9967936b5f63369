"""The live merge of made-up floors: known poses, and what the team may not disturb."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from mapping.geometry.similarity2 import Similarity2
from mapquilt.live.live_merger import LiveMerger, LiveState
from mapquilt.live.placement import displacement
from merge.pair.pipeline import match
from merge.records.verdict import Reason, Refusal
from tests.mapquilt.live.floors import explored, floor, in_frame, message

WORLD = floor()
FRAMES = {"robot_0": Similarity2(), "robot_1": Similarity2(3.0, -2.0, 2.1), "robot_2": Similarity2(-4.0, 1.0, -0.7)}
STARTS = {"robot_0": 3.0, "robot_1": 17.0, "robot_2": 10.0}


def sent(robot: str, step: int, frame: Similarity2 | None = None):
    """The map of a robot after some steps: it has explored both ways from its start."""
    reach = 1.0 + step
    part = explored(WORLD, max(0.0, STARTS[robot] - reach), min(20.0, STARTS[robot] + reach))
    return message(in_frame(part, frame or FRAMES[robot]), robot, float(step))


def drive(merger: LiveMerger, steps: range, robots=tuple(FRAMES)) -> list[LiveState]:
    return [merger.update([sent(robot, step)], step + 0.1 * k) for step in steps for k, robot in enumerate(robots)]


def check_poses(state: LiveState) -> None:
    """All poses agree with the truth, seen from the map that holds the frame."""
    reference = next(name for name, each in state.placements.items() if each.holds_frame)
    for name, pose in state.poses.items():
        truth = state.poses[reference] @ FRAMES[reference] @ FRAMES[name].inverse()
        shift, turn = displacement(truth, pose, state.robots[name].middle)
        assert shift < 0.1, name
        assert turn < math.radians(1.0), name


@pytest.fixture(scope="module")
def mission() -> tuple[LiveMerger, list[LiveState]]:
    merger = LiveMerger()
    return merger, drive(merger, range(1, 11))


def test_a_growing_team_joins_at_the_true_poses(mission):
    _, states = mission
    assert set(states[-1].poses) == set(FRAMES)
    check_poses(states[-1])


def test_no_wrong_pose_is_ever_published_and_the_frame_stays(mission):
    _, states = mission
    fixed = set()
    for state in states:
        if len(state.poses) > 1:
            check_poses(state)
            fixed.add(next(name for name, each in state.placements.items() if each.holds_frame))
    assert len(fixed) == 1


def test_the_merged_map_keeps_its_cells_while_it_grows(mission):
    _, states = mission
    rasters = [state.fused.merged.frame for state in states if state.fused is not None]
    first = rasters[0]
    for frame in rasters:
        cells = first.origin.inverse().apply([(frame.origin.x, frame.origin.y)]) / first.resolution
        np.testing.assert_allclose(cells, np.round(cells), atol=1e-6)
        assert frame.resolution == first.resolution


def test_the_same_messages_give_the_same_states(mission):
    _, states = mission
    again = drive(LiveMerger(), range(1, 11))
    assert [state.events for state in again] == [state.events for state in states]
    assert again[-1].poses == states[-1].poses


def test_unchanged_maps_match_nothing_again():
    merger = LiveMerger()
    drive(merger, range(8, 11))
    before = merger.state
    after = merger.update([sent(robot, 10) for robot in FRAMES], 20.0)
    assert after.pairs == before.pairs
    assert after.poses == before.poses


def test_pairs_are_matched_while_no_map_comes_and_nothing_moves_by_that():
    merger = LiveMerger()
    before = merger.update([sent(robot, 10) for robot in FRAMES], 1.0)
    assert len(before.pairs) == 1
    assert [merger.catch_up() for _ in range(3)] == [True, True, False]
    assert len(merger.state.pairs) == 3
    assert all(entry.answer.accepted for entry in merger.state.pairs.values())
    assert merger.state.placements == before.placements
    assert merger.state.events == before.events
    check_poses(drive(merger, range(11, 14))[-1])
    assert set(merger.state.poses) == set(FRAMES)


def test_robots_that_stand_still_join_by_time():
    """As when a merger is started once the robots have explored all."""
    merger = LiveMerger()
    merger.update([sent(robot, 10) for robot in FRAMES], 1.0)
    while merger.catch_up():
        pass
    before = merger.state
    assert len(before.poses) <= 1
    assert merger.update([sent(robot, 10) for robot in FRAMES], 15.9).placements == before.placements
    now, steps = 16.0, 0
    while len(merger.state.poses) < len(FRAMES):
        assert merger.is_still(now)
        merger.update([], now)
        assert not merger.is_still(now + 0.9 * merger.settings.still_after)
        now, steps = now + merger.settings.still_after, steps + 1
        assert steps <= merger.settings.placement.confirmations
    assert steps >= merger.settings.placement.confirmations - 1
    check_poses(merger.state)
    joined = merger.state
    merger.update([], now)
    assert merger.state.placements == joined.placements
    merger.frozen = True
    assert not merger.is_still(now + 100.0)


def test_a_frozen_merge_holds_its_poses_and_fuses_new_cells():
    merger = LiveMerger()
    before = drive(merger, range(7, 10))[-1]
    merger.frozen = True
    after = merger.update([sent("robot_1", 14)], 30.0)
    assert after.placements == before.placements
    assert not merger.catch_up()
    assert np.count_nonzero(after.fused.merged.known) > np.count_nonzero(before.fused.merged.known)


def test_a_robot_that_restarts_leaves_and_joins_anew_in_its_new_frame():
    merger = LiveMerger()
    drive(merger, range(8, 12))
    held = next(name for name, each in merger.state.placements.items() if each.holds_frame)
    before = merger.state.poses
    turned = Similarity2(1.0, 6.0, -1.2)
    state = merger.update([sent(held, 9, turned)], 20.0)
    assert held not in state.poses
    assert any(event.startswith(f"{held}: restarted: its map keeps") for event in state.events)
    assert any(event.startswith(f"{held}: left: restarted: its map keeps") for event in state.events)
    for name in before.keys() - {held}:  # the others are corrected by little, as at any update
        shift, turn = displacement(before[name], state.poses[name], state.robots[name].middle)
        assert shift < 0.01
        assert turn < math.radians(0.1)
    for step in range(10, 14):
        state = merger.update([sent(held, step, turned)], 20.0 + step)
    other = next(name for name in FRAMES if name != held)
    truth = state.poses[other] @ FRAMES[other] @ turned.inverse()
    shift, _ = displacement(truth, state.poses[held], state.robots[held].middle)
    assert shift < 0.1


def test_garbage_changes_no_pose_and_is_told():
    merger = LiveMerger()
    before = drive(merger, range(8, 11))[-1]
    bad = message(WORLD, "robot_1", 30.0, resolution=math.nan)
    after = merger.update([bad], 30.0)
    assert after.poses == before.poses
    assert after.events == ("robot_1: resolution is nan, must be finite; the message is ignored",)


def doubted(monkeypatch, elsewhere: Similarity2) -> list[LiveState]:
    """Join two robots; then matches from scratch find two answers equally good, the best one moved by ``elsewhere``."""
    merger = LiveMerger()
    before = drive(merger, range(2, 7), ("robot_0", "robot_2"))[-1]
    assert set(before.poses) == {"robot_0", "robot_2"}

    def ambiguous(task, cache):
        found = match(task, cache)
        moved = found.target_from_source @ elsewhere
        evidence = dataclasses.replace(found.evidence, score=0.99)
        refusal = Refusal(Reason.AMBIGUOUS)
        return dataclasses.replace(
            found, accepted=False, confidence=0.1, refusal=refusal, target_from_source=moved, evidence=evidence
        )

    monkeypatch.setattr("mapquilt.live.pair_answers.match", ambiguous)
    merger.settings = dataclasses.replace(merger.settings, growth=1e-6)
    return drive(merger, range(7, 12), ("robot_0", "robot_2"))


@pytest.mark.parametrize("elsewhere", [Similarity2(3.0, 0.0, 0.0), Similarity2.identity()])
def test_a_join_is_taken_back_if_another_place_fits_better_or_as_well(monkeypatch, elsewhere):
    """As in a corridor whose other end fits better once it is seen, or in a building with half-turn symmetry."""
    states = doubted(monkeypatch, elsewhere)
    told = [event for state in states for event in state.events]
    assert any("taken back: no pair supports it any more: with robot_" in event for event in told)
    assert any(event.endswith("two answers equally good") for event in told)
    assert len(states[-1].poses) <= 1


def test_two_different_floors_never_join():
    merger, other = LiveMerger(), floor(seed=7)
    for step in range(1, 9):
        merger.update([sent("robot_0", step)], float(step))
        part = explored(other, 0.0, 2.0 + 2.0 * step)
        state = merger.update([message(in_frame(part, FRAMES["robot_1"]), "robot_1", float(step))], step + 0.5)
        assert not state.poses
        assert state.fused is None
