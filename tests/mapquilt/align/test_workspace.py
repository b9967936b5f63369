"""Snap, candidates, measurements and merges from the page, against the merger itself."""

from __future__ import annotations

import math
import shlex

import numpy as np
import pytest
from scipy.spatial import cKDTree

from mapping.geometry.similarity2 import Similarity2
from mapping.io.map_file import load_map, save_map
from mapquilt.align.measurement import CONTRADICTION, MATCH, NO_OPINION, combine_classes
from mapquilt.align.merge_command import arranged_settings
from mapquilt.align.open_task import open_task
from mapquilt.align.saving import command as repeat
from mapquilt.align.saving import exports, save
from mapquilt.align.workspace import Workspace
from mapquilt.json_file import read_record
from merge.merger import match_maps
from merge.pair.pipeline import match_near
from tests.conftest import command, hashes
from tests.mapquilt.align.conftest import Two, sheet_pose
from tests.merge.test_merger import team


def walls_apart(workspace: Workspace, found: Similarity2, truth: Similarity2) -> float:
    points = workspace.measurer.wall_points(1)
    return float(np.hypot(*(found.apply(points) - truth.apply(points)).T).mean())


def rough(workspace: Workspace, two: Two, shift: float, turn_deg: float) -> Similarity2:
    """The true pose, off by a shift [m] and a turn about the middle of the map's walls."""
    middle = two.target_from_source.apply(workspace.measurer.wall_points(1).mean(axis=0))
    return Similarity2(0.6 * shift, -0.8 * shift) @ (
        Similarity2(yaw=math.radians(turn_deg)).about(middle) @ two.target_from_source
    )


@pytest.mark.parametrize("turn_deg", [-15.0, 15.0])
def test_snap_finds_the_place_from_two_metres_and_fifteen_degrees_off(workspace, two, turn_deg) -> None:
    workspace.place(1, sheet_pose(workspace, rough(workspace, two, 2.0, turn_deg)))
    before = workspace.arrangement
    expected = match_near(workspace.snap_task(1, 0).task)
    answer = workspace.snap(1, 0)
    assert answer.accepted and answer.confidence > 0.9
    assert (answer.target_from_source, answer.evidence) == (expected.target_from_source, expected.evidence)
    found = workspace.arrangement.target_from_source(0, 1)
    assert walls_apart(workspace, found, two.target_from_source) < 0.05
    assert workspace.arrangement.placements[1].decided_by == "snap"
    workspace.undo()
    assert workspace.arrangement is before


def test_the_score_is_greatest_where_the_maps_fit_and_walls_say_why(workspace, two) -> None:
    right = workspace.measurer.measure(0, 1, two.target_from_source)
    off = workspace.measurer.measure(0, 1, rough(workspace, two, 1.0, 0.0))
    assert right.overlap.score > 0.75 > 0.4 > off.overlap.score
    share = [np.bincount(each.source_classes, minlength=3) / len(each.source_classes) for each in (right, off)]
    assert share[0][MATCH] > share[1][MATCH] + 0.3
    assert share[1][CONTRADICTION] > share[0][CONTRADICTION] + 0.2
    assert len(right.source_classes) == len(workspace.measurer.wall_points(1))


def test_any_match_outweighs_a_contradiction_and_that_no_opinion() -> None:
    none, match, against = NO_OPINION, MATCH, CONTRADICTION
    columns = [(a, b) for a in (none, match, against) for b in (none, match, against)]
    first, second = (np.array(each, np.uint8) for each in zip(*columns, strict=True))
    wanted = [match if match in pair else max(pair) for pair in columns]
    np.testing.assert_array_equal(combine_classes([first, second], 9), wanted)


def test_candidates_are_those_of_the_merger_and_either_map_can_be_moved(workspace, two) -> None:
    (expected,) = match_maps(workspace.maps)
    answer, found = workspace.candidates(1, 0)
    assert answer.evidence == expected.evidence
    assert found[0][0] == expected.target_from_source
    assert [score for _, score in found[1:]] == [each.score for each in expected.alternatives]
    workspace.choose(1, 0, 0)
    moved = workspace.arrangement.target_from_source(0, 1)
    workspace.choose(0, 1, 0)
    back = workspace.arrangement.target_from_source(0, 1)
    for each in (moved, back):
        assert walls_apart(workspace, each, expected.target_from_source) < 1e-6
    with pytest.raises(ValueError, match="candidate is 99, must be 0 to"):
        workspace.choose(1, 0, 99)


def test_saved_files_equal_those_of_the_command_that_the_page_shows(workspace, two, tmp_path) -> None:
    workspace.place(1, sheet_pose(workspace, rough(workspace, two, 0.4, 3.0)))
    solved = workspace.solve()
    assert workspace.solve() is solved
    assert "align.json" in {path.name for path in save(workspace, solved)}
    record = read_record(tmp_path / "out/align.json", "align")
    assert [entry["decided_by"] for entry in record["maps"]] == ["reference", "hand"]
    words = shlex.split(repeat(workspace, solved))
    assert words[:2] == ["mapquilt", "merge"] and words[-2:] == ["--out", str(tmp_path / "out")]
    assert command(*words[1:-1], tmp_path / "again") == 0
    ledger = ".mapquilt-files.json"
    saved = hashes(tmp_path / "out", but=("align.json", ledger))
    assert saved == hashes(tmp_path / "again", but=(ledger,))
    assert {"merge.json", "merged.pgm", "transforms.yaml", "inputs/0/a.yaml"} <= saved.keys()
    texts = exports(workspace, solved)
    assert "static_transform_publisher" in texts["tf"] and "--frame-id a/map" in texts["tf"]
    assert texts["yaml"] == (tmp_path / "out/transforms.yaml").read_text()


def test_a_place_stays_decided_whichever_map_moves_and_is_the_reference(workspace, two) -> None:
    start = workspace.arrangement
    settings = workspace.task.settings

    def priors() -> list[str]:
        return [prior.name for prior in arranged_settings(settings, workspace.arrangement, workspace.maps).priors]

    assert priors() == []
    workspace.place(0, start.placements[1].sheet_from_map @ two.target_from_source.inverse())
    assert priors() == ["b"]
    workspace.change(workspace.arrangement.with_reference(1))
    assert priors() == ["a"]
    workspace.undo()
    workspace.undo()
    workspace.place(1, sheet_pose(workspace, two.target_from_source))
    assert priors() == ["b"]
    workspace.change(workspace.arrangement.with_reference(1))
    assert priors() == ["a"]
    pose = workspace.arrangement.target_from_source(0, 1)
    assert walls_apart(workspace, pose, two.target_from_source) < 1e-9


def test_a_merge_forgets_who_placed_its_maps(workspace, two, tmp_path) -> None:
    workspace.place(1, sheet_pose(workspace, two.target_from_source))
    save(workspace, workspace.solve())
    assert command("merge", *two.files, "--out", tmp_path / "out") == 0
    assert not (tmp_path / "out/align.json").exists()


def test_the_map_without_a_yaw_is_that_of_convert_and_a_later_save_without_it_deletes_it(
    workspace, two, tmp_path
) -> None:
    out = tmp_path / "out"
    save(workspace, workspace.solve(), yaw_zero=True)
    assert command("convert", out / "merged.yaml", tmp_path / "merged_yaw_0.yaml", "--yaw", 0) == 0
    for name in ("merged_yaw_0.yaml", "merged_yaw_0.pgm"):
        assert (out / name).read_bytes() == (tmp_path / name).read_bytes()
    save(workspace, workspace.solve())
    assert not list(out.glob("merged_yaw_0*"))


def test_the_map_in_the_frame_of_another_continues_its_cells_and_has_the_same_walls(workspace, two, tmp_path) -> None:
    workspace.place(1, sheet_pose(workspace, two.target_from_source))
    solved, out = workspace.solve(), tmp_path / "out"
    save(workspace, solved, frame_of=1)
    found, own = load_map(out / "merged_in_frame.yaml").grid, workspace.maps.grids[1]
    assert (found.frame.resolution, found.frame.origin.yaw) == pytest.approx(
        (own.frame.resolution, own.frame.origin.yaw)
    )
    corner = own.frame.origin.inverse() @ found.frame.origin
    steps = np.array([corner.x, corner.y]) / own.frame.resolution
    assert steps == pytest.approx(np.round(steps), abs=1e-3)
    merged = solved.result.merged
    walls = solved.result.reference_from_map["b"].apply(found.frame.metres_from_cells(np.argwhere(found.occupied)))
    truth = merged.frame.metres_from_cells(np.argwhere(merged.occupied))
    apart = cKDTree(truth).query(walls)[0]
    assert apart.max() < 1.5 * own.frame.resolution
    assert 0.7 < len(walls) / len(truth) < 1.4
    assert read_record(out / "align.json", "align")["in_frame_of"] == "b"
    save(workspace, solved)
    assert not list(out.glob("merged_in_frame*"))


def test_the_frame_of_a_map_that_was_left_out_is_refused_before_anything_is_written(two, tmp_path) -> None:
    maps, _ = team(3, 2)
    save_map(maps.grids[0], tmp_path / "other")
    workspace = Workspace(open_task((two.files[0], tmp_path / "other.yaml"), tmp_path / "out", None, None, 0))
    solved = workspace.solve()
    assert "other" in solved.result.left_out
    with pytest.raises(ValueError, match="other: was left out of the merge"):
        save(workspace, solved, frame_of=1)
    assert not (tmp_path / "out").exists()


def test_maps_can_be_saved_exactly_as_placed_and_not_before_each_is_placed(workspace, two, tmp_path) -> None:
    with pytest.raises(ValueError, match="b: has not been placed"):
        workspace.stitch()
    wrong = rough(workspace, two, 3.0, 40.0)
    workspace.place(1, sheet_pose(workspace, wrong))
    solved = workspace.stitch()
    save(workspace, solved)
    record = read_record(tmp_path / "out/align.json", "align")
    assert not record["verified"]
    pose = solved.result.reference_from_map["b"]
    assert walls_apart(workspace, pose, wrong) < 0.002
    assert "--trust-priors" in repeat(workspace, solved)
    scaled = Similarity2(wrong.x, wrong.y, wrong.yaw, 1.1)
    workspace.place(1, sheet_pose(workspace, scaled))
    with pytest.raises(ValueError, match=r"b: scale is 1\.1, must be 1"):
        workspace.stitch()


def test_a_saved_merge_opens_as_it_was_saved(workspace, two, tmp_path) -> None:
    workspace.place(1, sheet_pose(workspace, two.target_from_source))
    save(workspace, workspace.solve())
    again = Workspace(open_task([tmp_path / "out"], None, None, None, 0))
    assert again.maps.names == ("a", "b")
    there, here = (each.arrangement.target_from_source(0, 1) for each in (workspace, again))
    assert walls_apart(workspace, here, there) < 1e-9
    assert {each.decided_by for each in again.arrangement.placements} == {"automatic"}
    with pytest.raises(ValueError, match="--out: applies to map files only"):
        open_task([tmp_path / "out"], tmp_path / "other", None, None, 0)
