"""The measures of a replayed mission, on states made up for it: jumps, wrong joins and when they ended."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import pytest

from benchmarks import live_missions
from benchmarks.live_missions import explore_joins, measure
from benchmarks.live_team import LiveTeam, MissionPlan, simulate_team
from mapping.geometry.similarity2 import Similarity2
from mapquilt.live.live_merger import LiveState
from mapquilt.live.placement import Placement, Sighting, State, anchor
from mapquilt.live.received_map import MapMessage
from mapquilt.live.robots import Robot, heard
from mapquilt.live.settings import LiveSettings

pytestmark = pytest.mark.slow

PLAN = MissionPlan(3, "house", 2, 8.0, "close", 0.0, 0.0)


@pytest.fixture(scope="module")
def team() -> LiveTeam:
    return simulate_team(PLAN)


def true_pose(team: LiveTeam) -> Similarity2:
    """Pose of the second robot's map in the first one's: both map without error from where they start."""
    starts = [Similarity2.from_se2(robot.truth.trajectory.pose(0)) for robot in team.robots.values()]
    return starts[0].inverse() @ starts[1]


class Scripted:
    """Publish one given pose of the second robot after each map; None publishes none."""

    def __init__(self, poses: Sequence[Similarity2 | None]) -> None:
        self.state, self._poses = LiveState(), list(poses)

    def update(self, messages: Sequence[MapMessage], now: float) -> LiveState:
        robots = dict(self.state.robots)
        for message in messages:
            robots[message.robot] = heard(robots.get(message.robot, Robot(message.robot)), message, now)
        pose = self._poses.pop(0)
        placements = {name: Placement() for name in robots} | {"robot_0": anchor(Similarity2.identity())}
        if pose is not None:
            placements["robot_1"] = Placement(State.JOINED, Sighting(pose, 0.1, 0.01, 0.99))
        self.state = replace(self.state, robots=robots, placements=placements)
        return self.state


def measured(team: LiveTeam, monkeypatch: pytest.MonkeyPatch, poses: Sequence[Similarity2 | None]):
    monkeypatch.setattr(live_missions, "LiveMerger", lambda settings: Scripted(poses))
    return measure(team, LiveSettings())


def test_the_maps_are_those_of_two_robots_every_two_seconds(team):
    assert [now for now, _ in team.messages] == pytest.approx([2.0, 2.0, 4.0, 4.0, 6.0, 6.0, 8.0, 8.0], abs=0.21)
    assert {message.robot for _, message in team.messages} == set(team.robots) == {"robot_0", "robot_1"}


def test_true_poses_are_right_and_no_jump(team, monkeypatch):
    true = true_pose(team)
    outcome = measured(team, monkeypatch, [None, *[true] * 7])
    assert outcome.first_right == team.messages[1][0]
    assert (outcome.jumps, outcome.returns, outcome.wrong) == ([], [], [])
    assert (outcome.joined, outcome.joinable) == (2, 2)


def test_a_wrong_join_stands_until_it_is_taken_back_and_its_return_is_no_jump(team, monkeypatch):
    true = true_pose(team)
    wrong = true @ Similarity2(3.0, 0.0, 0.0)
    outcome = measured(team, monkeypatch, [None, wrong, wrong, wrong, None, true, true, true])
    (found,) = outcome.wrong
    assert (found.since, found.until) == (team.messages[1][0], team.messages[4][0])
    assert found.elsewhere
    assert found.metres == pytest.approx(3.0, abs=0.05)
    assert outcome.first_right == team.messages[5][0]
    assert outcome.jumps == []
    assert outcome.returns == [(team.messages[5][0], "robot_1", pytest.approx(3.0), pytest.approx(0.0))]


def test_a_pose_that_moves_while_it_is_published_is_a_jump(team, monkeypatch):
    true = true_pose(team)
    moved = true @ Similarity2(0.3, 0.0, 0.0)
    outcome = measured(team, monkeypatch, [None, *[true] * 3, *[moved] * 4])
    assert outcome.jumps == [(team.messages[4][0], "robot_1", pytest.approx(0.3), pytest.approx(0.0))]


def test_the_same_plan_gives_the_same_maps_and_joins(team):
    again = simulate_team(PLAN)
    assert all((a.cells == b.cells).all() for (_, a), (_, b) in zip(team.messages, again.messages, strict=True))
    assert explore_joins(team) == explore_joins(again)
