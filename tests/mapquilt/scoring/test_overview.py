"""Pictures of a run lie as the frames say: what is drawn is looked up again, in metres."""

import colorsys
import dataclasses

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from scipy import ndimage

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.map_set import MapSet
from mapquilt.merging.merge_file import GroupRecord
from mapquilt.runs import folder as run_folder
from mapquilt.runs.truth_file import load_truth
from mapquilt.scoring.overview import overview_figure
from mapquilt.scoring.run_score import RunScore
from mapquilt.scoring.true_scene import mission_scene
from mapquilt.viz.merge_picture import merge_figure
from mapquilt.viz.palette import map_colours, robot_colour
from mapquilt.viz.panels import Extent, lay_out
from merge.fusion import fuse_and_compare
from merge.records.result import MergedGroup
from sim.mission.file import load_mission


def looked_at(figure, panel):
    """The pixels of a panel, (H, W, 3) int, top row first, and the metres (H, W, 2) of their centres."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    image = np.asarray(canvas.buffer_rgba())[..., :3].astype(int)
    axes = figure.axes[panel]
    left, low, right, high = (round(edge) for edge in axes.bbox.extents)
    rows, cols = np.mgrid[image.shape[0] - high + 2 : image.shape[0] - low - 2, left + 2 : right - 2]
    display = np.stack((cols + 0.5, image.shape[0] - rows - 0.5), axis=-1)
    metres = axes.transData.inverted().transform(display.reshape(-1, 2)).reshape(display.shape)
    return image[rows, cols], metres


def coloured(pixels, least=60):
    return np.ptp(pixels, axis=-1) > least


def room(yaw):
    """A room of 12 x 8 m whose walls no turn brings onto themselves, in a frame that is turned and shifted."""
    values = np.zeros((16, 24), np.int8)
    values[:, :2] = values[:2] = values[10:, 15:18] = 100
    values[12:, :6] = -1
    return OccupancyGrid.from_occupancy(GridFrame(0.5, SE2(3.0, -7.0, yaw), values.shape), values)


def group(grid, placed=None):
    return MergedGroup("a", placed or {}, grid, OccupancyGrid(grid.frame, np.zeros(grid.frame.shape)))


@pytest.mark.parametrize("yaw", [0.0, 0.6, -2.5])
def test_a_map_is_drawn_at_the_yaw_of_its_origin(yaw):
    grid = room(yaw)
    figure = merge_figure(MapSet(("a", "b"), (grid, grid), ("m", "m")), [group(grid)])
    for panel in (0, 1):
        pixels, metres = looked_at(figure, panel)
        cells = grid.frame.cells_from_metres(metres[(pixels < 60).all(axis=-1)])
        assert grid.frame.contains(cells).all()
        assert grid.occupied[cells[:, 0], cells[:, 1]].mean() > 0.99
        drawn = np.zeros(grid.frame.shape, bool)
        drawn[cells[:, 0], cells[:, 1]] = True
        assert (drawn == grid.occupied).all()


def test_the_walls_of_each_map_lie_over_one_another_beside_the_merged_map():
    target = room(0.4)
    target_from_source = Similarity2(2.0, -1.0, 0.9, 1.3)
    there = target_from_source.inverse()
    origin = there @ Similarity2.from_se2(target.frame.origin)
    frame = GridFrame(0.5 / 1.3, SE2(origin.x, origin.y, origin.yaw), target.frame.shape)
    source = OccupancyGrid(frame, target.log_odds)
    placed = {"a": Similarity2(), "b": target_from_source}
    fused = fuse_and_compare(target.frame, [(Similarity2(), target), (target_from_source, source)])
    joined = MergedGroup("a", placed, fused.merged, fused.conflicts)
    figure = merge_figure(MapSet(("a", "b"), (target, source), ("m", "m")), [joined])
    pixels, metres = looked_at(figure, 1)
    cells = target.frame.cells_from_metres(metres)
    inside = target.frame.contains(cells)
    wall = np.zeros(inside.shape, bool)
    wall[inside] = target.occupied[tuple(cells[inside].T)]
    at_an_edge = ndimage.maximum_filter(wall, 5) != ndimage.minimum_filter(wall, 5)
    assert (coloured(pixels) == wall)[~at_an_edge].all()
    assert wall[~at_an_edge].sum() > 1000


def test_the_picture_of_the_merged_map_shows_its_cells_and_conflicts_in_red():
    """The walls that the picture shows are those of the file, although the maps have others."""
    merged, maps_grid = room(0.0), OccupancyGrid.from_occupancy(room(0.0).frame, np.full((16, 24), 100))
    conflicts = np.zeros((16, 24), np.int8)
    conflicts[4:6, 4:8] = 100
    lost, kept = conflicts == 100, np.zeros((16, 24), bool)
    conflicts[10:14, 15:18] = kept[10:14, 15:18] = 100
    placed = {"a": Similarity2(), "b": Similarity2()}
    joined = MergedGroup("a", placed, merged, OccupancyGrid.from_occupancy(merged.frame, conflicts))
    pixels, metres = looked_at(merge_figure(MapSet(("a", "b"), (maps_grid, maps_grid), ("m", "m")), [joined]), 0)
    cells = merged.frame.cells_from_metres(metres)
    inside = merged.frame.contains(cells)
    red = coloured(pixels, 120)
    black = (pixels < 60).all(axis=-1)
    for mask, seen in ((merged.occupied, black | red), (kept, red), (lost, coloured(pixels, 50) & ~red)):
        expected = np.zeros(inside.shape, bool)
        expected[inside] = mask[tuple(cells[inside].T)]
        at_an_edge = ndimage.maximum_filter(expected, 5) != ndimage.minimum_filter(expected, 5)
        assert (seen == expected)[~at_an_edge].all()
        assert expected[~at_an_edge].sum() > 200


def hue(colour):
    return colorsys.rgb_to_hsv(*to_rgb(colour))[0]


def test_the_parts_of_a_robot_are_shades_of_its_colour():
    names = [f"robot_{robot}_part_{part}" for robot in range(3) for part in range(4)]
    colours = map_colours(names)
    assert len(set(colours)) == len(names)
    for index, colour in enumerate(colours):
        assert hue(colour) == pytest.approx(hue(robot_colour(index // 4)), abs=0.02)


def test_maps_that_are_not_cut_have_the_colours_of_their_robots_or_of_their_order():
    assert map_colours(["robot_2", "robot_0"]) == (robot_colour(2), robot_colour(0))
    assert map_colours(["hall", "robot_5"]) == (robot_colour(0), robot_colour(1))


@pytest.mark.parametrize("count", range(1, 13))
def test_panels_share_size_and_rows_and_the_last_row_is_centred(count):
    extents = [Extent(0.0, 10.0 + 3 * k, -5.0, 5.0 + 40 * (k % 2)) for k in range(count)]
    _, panels = lay_out(extents, legend_inches=0.5)
    boxes = np.array([panel.get_position().bounds for panel in panels])
    np.testing.assert_allclose(boxes[:, 2:], np.broadcast_to(boxes[0, 2:], (count, 2)))
    rows = [boxes[np.isclose(boxes[:, 1], bottom)] for bottom in np.unique(boxes[:, 1].round(9))[::-1]]
    assert len({len(row) for row in rows[:-1]}) <= 1
    middles = [row[:, 0].mean() for row in rows]
    assert middles == pytest.approx([middles[0]] * len(rows))
    for panel, extent in zip(panels, extents, strict=True):
        (left, right), (low, high) = panel.get_xlim(), panel.get_ylim()
        assert left < extent.left < extent.right < right
        assert low < extent.low < extent.high < high
        pixels = panel.bbox.width / (right - left), panel.bbox.height / (high - low)
        assert pixels[0] == pytest.approx(pixels[1])


@pytest.mark.parametrize("name", ["robot_19_part_19", "somewhere/" * 12 + "$map_1$.yaml"])
def test_a_title_fits_its_panel(name):
    grid = room(0.0)
    figure = merge_figure(
        MapSet((name, "b"), (grid, grid), ("m", "m")), [dataclasses.replace(group(grid), reference=name)]
    )
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    assert figure.axes[1].get_title(loc="left").endswith(name[-16:])
    for panel in figure.axes:
        for text in (*panel.texts, panel._left_title):
            assert text.get_window_extent(canvas.get_renderer()).x1 <= panel.bbox.x1


def test_true_transforms_align_the_merged_walls_with_the_true_ones(merged_run):
    maps, truth = run_folder.load_maps(merged_run), load_truth(merged_run / "truth.json")
    world_from = {name: truth.robot(name).truth.world_from_map for name in maps.names}
    mission, reference = load_mission(merged_run / "mission"), maps.names[1]
    placed = {name: world_from[reference].inverse() @ world_from[name] for name in maps.names}
    joined = GroupRecord(reference, placed, "merged"), maps.grids[1]
    figure = overview_figure(mission_scene(mission), maps, truth, [joined], RunScore(()))
    pixels, metres = looked_at(figure, 2)
    bare_group = GroupRecord(reference, {}, "merged"), maps.grids[1]
    bare, _ = looked_at(overview_figure(mission_scene(mission), maps, truth, [bare_group], RunScore(())), 2)
    from_wall = ndimage.distance_transform_edt((bare > 230).all(axis=-1))
    metre = 1.0 / np.diff(metres[0, :2, 0])[0]
    off = from_wall[coloured(pixels)] / metre
    assert off.size > 300
    assert np.quantile(off, 0.95) < 0.3


def test_two_groups_have_a_panel_each_and_maps_say_in_which_they_are():
    grid = room(0.4)
    maps = MapSet(("a", "b", "c", "d", "e"), (grid,) * 5, ("m",) * 5)
    groups = [
        MergedGroup(first, {first: Similarity2(), second: Similarity2()}, grid, group(grid).conflicts)
        for first, second in (("a", "b"), ("c", "d"))
    ]
    figure = merge_figure(maps, [*groups, group(grid, {"e": Similarity2()})])
    titles = [panel.get_title(loc="left") for panel in figure.axes]
    assert titles == [
        *("merged map 1", "merged map 2", "walls of merged map 1", "walls of merged map 2"), "a", "b", "c", "d", "e",
    ]  # fmt: skip
    labels = [panel.texts[0].get_text() for panel in figure.axes]
    assert labels[4:] == ["in merged map 1"] * 2 + ["in merged map 2"] * 2 + ["not merged"]
