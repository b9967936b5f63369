"""Plans of other programs: each small file is a room of known walls, read to the millimetre."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from worlds.floor import find_floor, require_drivable
from worlds.importing.houseexpo import houseexpo_world, is_houseexpo
from worlds.importing.open_rmf import building_world, is_building
from worlds.importing.plan_file import PlanOptions, read_plan
from worlds.importing.vector_map import is_vector_map, vector_map_world
from worlds.world import World

ROOM = [(0.0, 0.0), (6.0, 0.0), (6.0, 4.0), (0.0, 4.0)]


def clearance(world: World, *points: tuple[float, float]) -> list[float]:
    """Distances to the nearest solid from points in the frame of the room, whose corner the world leaves alone."""
    low = np.min([polygon.min(axis=0) for polygon in world.obstacles[:4]], axis=0)
    return world.clearance(np.array(points) + low + 0.05).tolist()


# HouseExpo


def test_the_inside_of_a_house_is_free_to_its_corners() -> None:
    verts = [[0, 0], [8, 0], [8, 5], [4, 5], [4, 3], [0, 3]]
    for order in (verts, verts[::-1], [*verts, verts[0]]):
        world = require_drivable(houseexpo_world("house", {"verts": order}))
        offset = 0.15
        inside = np.array([(0.01, 0.01), (7.99, 4.99), (3.99, 2.99), (4.01, 4.99), (4.01, 3.01), (6.0, 2.0)]) + offset
        assert world.clearance(inside) == pytest.approx([0.01, 0.01, 0.01, 0.01, 0.01, 2.0])
        outside = np.array([(-0.01, 1.0), (3.99, 3.01), (3.0, 4.0), (8.02, 4.0)]) + offset
        assert world.clearance(outside).tolist() == [0.0, 0.0, 0.0, 0.0]
        assert sum(find_floor(world, radius=0.0).areas) == pytest.approx(8 * 3 + 4 * 2, rel=0.02)


@pytest.mark.parametrize(
    "verts", [[], [[0, 0], [1, 1]], [[0, 0], [4, 4], [4, 0], [0, 4]], [["a", 0]], "no", [[0, 0, 1]]]
)
def test_a_house_without_a_simple_polygon_is_refused(verts: Any) -> None:
    with pytest.raises(ValueError, match="verts"):
        houseexpo_world("house", {"verts": verts})


# UT AMRL


def segments(points: list[tuple[float, float]]) -> list[dict[str, Any]]:
    ends = [*points[1:], points[0]]
    return [{"p0": {"x": a[0], "y": a[1]}, "p1": {"x": b[0], "y": b[1]}} for a, b in zip(points, ends, strict=True)]


def test_segments_of_a_vector_map_are_walls_of_10_cm() -> None:
    record = segments([(x - 30.0, y + 12.0) for x, y in ROOM])
    world = require_drivable(vector_map_world("lab", [*record, record[0]]))
    assert world.size == pytest.approx((6.3, 4.3))
    assert clearance(world, (3.0, 2.0), (1.0, 2.0), (5.5, 1.5)) == pytest.approx([1.95, 0.95, 0.45])


def test_a_malformed_segment_is_named() -> None:
    with pytest.raises(ValueError, match="segment 1 must have p0 and p1"):
        vector_map_world("lab", [*segments(ROOM)[:1], {"p0": {"x": 0}, "p1": {}}])
    assert not is_vector_map([])
    assert not is_vector_map([1, 2])


# Open-RMF


def building(**levels: Any) -> dict[str, Any]:
    return {"name": "clinic", "coordinate_system": "cartesian_meters", "levels": levels}


def level(**changes: Any) -> dict[str, Any]:
    """A room of 6 x 4 m with a wall across at x = 3 m, in which lies a door of 1 m from y = 1 to 2 m."""
    points = [*ROOM, (3.0, 0.0), (3.0, 4.0), (3.0, 1.0), (3.0, 2.0)]
    return {
        "elevation": 0,
        "vertices": [[x, y, 0, ""] for x, y in points],
        "walls": [[0, 1, {}], [1, 2, {}], [2, 3, {}], [3, 0, {}], [4, 5, {"alpha": [3, 1]}]],
        "doors": [[6, 7, {"type": [1, "hinged"]}]],
        **changes,
    }


def test_doors_stand_open_in_walls_of_10_cm() -> None:
    world = require_drivable(building_world("clinic", building(L1=level())))
    assert len(find_floor(world).areas) == 1
    assert clearance(world, (3.0, 1.5), (3.0, 1.01), (3.0, 0.99), (3.0, 2.01), (1.0, 2.0)) == pytest.approx(
        [0.5, 0.01, 0.0, 0.0, 0.95]
    )


def test_a_wall_that_ends_at_a_door_leaves_it_as_wide() -> None:
    split = level(walls=[[0, 1], [1, 2], [2, 3], [3, 0], [4, 6], [7, 5]])
    whole, parts = (building_world("clinic", building(L1=each)) for each in (level(), split))
    assert clearance(parts, (3.0, 1.01), (3.0, 0.99)) == pytest.approx(clearance(whole, (3.0, 1.01), (3.0, 0.99)))


def test_a_level_without_doors_is_in_two_parts() -> None:
    with pytest.raises(ValueError, match="2 parts"):
        require_drivable(building_world("clinic", building(L1=level(doors=[]))))


def pixels(scale: float, **changes: Any) -> dict[str, Any]:
    """The same level on a drawing of ``scale`` metres a pixel, y down."""
    drawn = level(**changes)
    drawn["vertices"] = [[x / scale, 500.0 - y / scale, 0, ""] for x, y, *_ in drawn["vertices"]]
    return drawn


def test_pixels_of_a_drawing_are_scaled_by_its_measurements() -> None:
    measured = pixels(0.02, measurements=[[0, 1, {"distance": [3, 6.0]}], [1, 2, {"distance": [3, 4.0]}]])
    record = {"name": "clinic", "levels": {"L1": measured}}
    world, expected = building_world("clinic", record), building_world("clinic", building(L1=level()))
    assert world.size == pytest.approx(expected.size)
    assert clearance(world, (3.0, 1.01), (1.0, 2.0)) == pytest.approx([0.01, 0.95])


def test_a_level_without_measurements_is_scaled_by_fiducials_in_common() -> None:
    marks = [(1.0, 1.0, "a"), (5.0, 3.0, "b")]
    one, two = (
        pixels(scale, fiducials=[[x / scale, 500.0 - y / scale, name] for x, y, name in marks])
        for scale in (0.02, 0.05)
    )
    one["measurements"] = [[0, 1, {"distance": [3, 6.0]}]]
    record = {"name": "clinic", "reference_level_name": "L1", "levels": {"L1": one, "L2": two}}
    assert building_world("clinic", record, "L2").size == pytest.approx((6.3, 4.3))
    with pytest.raises(ValueError, match="L2 has no measurements"):
        building_world("clinic", {**record, "levels": {"L1": one, "L2": {**two, "fiducials": []}}}, "L2")
    with pytest.raises(ValueError, match=r"L2\.measurements is empty"):
        building_world("clinic", {**record, "levels": {"L2": two}, "reference_level_name": "L2"}, "L2")


def test_one_of_several_levels_must_be_chosen() -> None:
    both = building(L1=level(), L2=level(walls=[[0, 1], [1, 2], [2, 3], [3, 0]]))
    assert len(building_world("clinic", both, "L2").obstacles) < len(building_world("clinic", both, "L1").obstacles)
    with pytest.raises(ValueError, match="has 2 levels: L1, L2; choose one by --level"):
        building_world("clinic", both)
    with pytest.raises(ValueError, match="has no level L3, only L1, L2"):
        building_world("clinic", both, "L3")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"walls": [[0, 99, {}]]}, "walls names vertex 99, but there are 8"),
        ({"walls": [["a", 1]]}, "walls must be a list"),
        ({"vertices": [[1]]}, "vertices must be a list"),
        ({"walls": []}, "no wall and no solid"),
    ],
)
def test_malformed_levels_are_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        building_world("clinic", building(L1=level(**changes)))
    with pytest.raises(ValueError, match="coordinate_system is web_mercator"):
        building_world("clinic", {**building(L1=level()), "coordinate_system": "web_mercator"})


# Gazebo

SDF = """<?xml version="1.0"?>
<sdf version="1.7"><world name="lab">
  <model name="ground"><link name="l"><collision name="c"><geometry><plane><normal>0 0 1</normal></plane></geometry>
  </collision></link></model>
  <include><uri>model://table</uri></include>
  <model name="walls"><pose>10 20 0 0 0 1.5707963267948966</pose><link name="l">
    {walls}
    <collision name="mesh"><geometry><mesh><uri>a.dae</uri></mesh></geometry></collision>
  </link></model>
  {more}
</world></sdf>
"""


def sdf_box(x: float, y: float, z: float, length: float, width: float, height: float, pose: str = "0 0 0") -> str:
    return (
        f'<collision name="c"><pose>{x} {y} {z} {pose}</pose><geometry><box><size>{length} {width} {height}</size>'
        "</box></geometry></collision>"
    )


WALLS = "".join(
    (
        sdf_box(3.0, -0.05, 1.0, 6.2, 0.1, 2.0),
        sdf_box(3.0, 4.05, 1.0, 6.2, 0.1, 2.0),
        sdf_box(-0.05, 2.0, 1.0, 0.1, 4.0, 2.0),
        sdf_box(6.05, 2.0, 1.0, 4.0, 0.1, 2.0, "0 0 1.5707963267948966"),
    )
)


def model(shape: str, pose: str) -> str:
    return (
        f'<model name="m"><pose>{pose}</pose><link name="l"><collision name="c"><geometry>{shape}</geometry>'
        "</collision></link></model>"
    )


def sdf_world(folder: Path, more: str = "") -> tuple[World, tuple[str, ...]]:
    path = folder / "lab.world"
    path.write_text(SDF.format(walls=WALLS, more=more), encoding="utf-8")
    return read_plan(path, None, PlanOptions())


def test_boxes_of_gazebo_stand_where_the_poses_say(tmp_path: Path) -> None:
    world, notes = sdf_world(tmp_path)
    require_drivable(world)
    assert world.size == pytest.approx((4.4, 6.4))  # turned by a right angle
    assert world.clearance([(0.2 + 1.0, 0.2 + 3.0), (0.2 + 3.5, 0.2 + 2.0)]) == pytest.approx([1.0, 0.5])
    assert [note.partition(": ")[2] for note in notes] == ["left out 1 of kind <include>", "left out 1 of kind <mesh>"]


@pytest.mark.parametrize(
    ("shape", "pose", "gap"),
    [
        ("<cylinder><radius>0.5</radius><length>1</length></cylinder>", "8 23 0.5 0 0 0", 0.5),
        ("<cylinder><radius>0.5</radius><length>1</length></cylinder>", "8 23 0.2 1.5707963267948966 0 0", 0.5),
        ("<sphere><radius>0.5</radius></sphere>", "8 23 0.5 0 0 0", 0.6),
        ("<box><size>1 1 1</size></box>", "8 23 3.0 0 0 0", 1.0),
        ("<box><size>0.2 4 1</size></box>", "8 23 0.2 0 1.5707963267948966 0", 0.5),
    ],
)
def test_solids_are_cut_at_the_height_of_the_lidar(tmp_path: Path, shape: str, pose: str, gap: float) -> None:
    """The point lies 1 m beside the axis of the solid in x, 1 m from the wall on its other side."""
    world, _ = sdf_world(tmp_path, model(shape, pose))
    (clear,) = world.clearance([(0.2 + 1.0, 0.2 + 3.0)])
    assert clear == pytest.approx(gap, abs=0.01)


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (model("<box><size>1 1</size></box>", "8 23 0 0 0 0"), "<size> is '1 1', must be 3 numbers"),
        (model("<box><size>1 -1 1</size></box>", "8 23 0 0 0 0"), "is -1, must be positive"),
        (model("<box><size>1 1 1</size></box>", "8 23 x 0 0 0"), "must be 6 numbers"),
        ('<model name="m"><pose relative_to="table">0 0 0 0 0 0</pose></model>', "relative to 'table'"),
        ("</world>", "is no XML"),
    ],
)
def test_malformed_worlds_of_gazebo_are_refused(tmp_path: Path, more: str, message: str) -> None:
    with pytest.raises(ValueError, match=rf"lab\.world: .*{message}"):
        sdf_world(tmp_path, more)


# DXF


def drawing(folder: Path, units: int, scale: float) -> Path:
    """The room in lines, a round pillar in a block, a hidden wall and a text."""
    ezdxf = pytest.importorskip("ezdxf")
    document = ezdxf.new()
    document.units = units
    space = document.modelspace()
    points = [(x / scale + 100.0, y / scale - 7.0) for x, y in ROOM]
    space.add_lwpolyline(points[:3])
    for start, end in zip(points[2:], (*points[3:], points[0]), strict=True):
        space.add_line(start, end)
    pillar = document.blocks.new("pillar")
    pillar.add_circle((0.0, 0.0), 0.5 / scale)
    space.add_blockref("pillar", (4.0 / scale + 100.0, 2.0 / scale - 7.0))
    document.layers.add("hidden").off()
    space.add_line(points[0], points[2], dxfattribs={"layer": "hidden"})
    space.add_text("room", height=1.0 / scale)
    path = folder / "room.dxf"
    document.saveas(path)
    return path


@pytest.mark.parametrize(("units", "scale"), [(4, 0.001), (6, 1.0), (5, 0.01), (1, 0.0254)])
def test_a_drawing_is_read_in_its_unit(tmp_path: Path, units: int, scale: float) -> None:
    world, notes = read_plan(drawing(tmp_path, units, scale), None, PlanOptions())
    assert world.size == pytest.approx((6.25, 4.25), abs=1e-3)
    points = np.array([(1.0, 2.0), (2.0, 2.0), (5.3, 2.0)]) + 0.125
    assert world.clearance(points) == pytest.approx([0.975, 1.475, 0.675], abs=0.01)
    assert f"{scale:g} m" in notes[0]


def test_a_drawing_without_unit_needs_one(tmp_path: Path) -> None:
    path = drawing(tmp_path, 0, 0.5)
    with pytest.raises(ValueError, match=r"room\.dxf: the drawing states no unit .* --plan-resolution"):
        read_plan(path, None, PlanOptions())
    assert read_plan(path, None, PlanOptions(resolution=0.5))[0].size == pytest.approx((6.25, 4.25), abs=1e-3)
    path.write_text("no drawing", encoding="utf-8")
    with pytest.raises(ValueError, match=r"room\.dxf: is no DXF drawing"):
        read_plan(path, None, PlanOptions(resolution=0.5))


# SVG

SVG = """<svg xmlns="http://www.w3.org/2000/svg" width="800" height="600" viewBox="0 0 400 300">
  <rect width="400" height="300" fill="white"/>
  <g transform="translate(50 250) scale(1 -1)">
    <rect width="300" height="200" fill="none" stroke="black" stroke-width="10"/>
    <polygon points="200,50 250,50 250,100 200,100" fill="#202020"/>
    <path d="M 20 180 h 30" stroke="#ffff00" fill="none"/>
  </g>
  <text x="60" y="60">room</text>
</svg>
"""


def test_strokes_are_walls_and_dark_fills_are_solid(tmp_path: Path) -> None:
    pytest.importorskip("svgelements")
    path = tmp_path / "room.svg"
    path.write_text(SVG, encoding="utf-8")
    world, notes = read_plan(path, None, PlanOptions(resolution=0.01))
    require_drivable(world)
    assert notes == ()
    assert world.size == pytest.approx((6.4, 4.4))
    points = np.array([(1.0, 2.0), (0.7, 3.6), (4.5, 1.5), (4.5, 2.4), (5.5, 1.5)]) + 0.2
    assert world.clearance(points) == pytest.approx([0.9, 0.3, 0.0, 0.4, 0.4])


def test_drawings_in_svg_need_a_resolution_and_must_be_svg(tmp_path: Path) -> None:
    pytest.importorskip("svgelements")
    path = tmp_path / "room.svg"
    path.write_text(SVG, encoding="utf-8")
    with pytest.raises(ValueError, match=r"room\.svg: .* needs --plan-resolution"):
        read_plan(path, None, PlanOptions())
    with pytest.raises(ValueError, match=r"room\.svg: the plan's resolution is -1"):
        read_plan(path, None, PlanOptions(resolution=-1.0))
    for text, message in (("<svg", "is no XML"), ("<svg/>", "no wall")):
        path.write_text(text, encoding="utf-8")
        with pytest.raises(ValueError, match=rf"room\.svg: .*{message}"):
            read_plan(path, None, PlanOptions(resolution=0.02))


def test_formats_are_told_apart_by_their_content() -> None:
    records: list[Any] = [{"verts": []}, segments(ROOM), building(L1=level()), {"schema": "mapquilt-world/1"}, [], {}]
    found = [[bool(test(record)) for test in (is_houseexpo, is_vector_map, is_building)] for record in records]
    assert found == [[True, False, False], [False, True, False], [False, False, True], *[[False] * 3] * 3]
    assert json.loads(json.dumps(records)) == records


@pytest.mark.parametrize(("name", "library"), [("room.dxf", "ezdxf"), ("room.svg", "svgelements")])
def test_a_missing_library_is_named_with_its_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, library: str
) -> None:
    (tmp_path / name).write_text(SVG, encoding="utf-8")
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(ImportError, match=rf"needs {library}: pip install 'mapquilt\[plans\]'"):
        read_plan(tmp_path / name, None, PlanOptions(resolution=0.02))


# Bounds


BOMB = """<?xml version="1.0" encoding="{encoding}"?>
<!DOCTYPE {root} [<!ENTITY a "1 "><!ENTITY b "&a;&a;&a;&a;">]>
<{root}>&b;</{root}>"""


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
@pytest.mark.parametrize(("name", "root"), [("plan.sdf", "sdf"), ("plan.svg", "svg")])
def test_entities_are_refused_in_any_encoding(tmp_path: Path, encoding: str, name: str, root: str) -> None:
    path = tmp_path / name
    path.write_bytes(BOMB.format(encoding=encoding, root=root).encode(encoding))
    with pytest.raises(ValueError, match=f"{name}: defines entities"):
        read_plan(path, None, PlanOptions(resolution=0.02 if root == "svg" else None))


def svg_plan(folder: Path, content: str) -> Path:
    path = folder / "plan.svg"
    path.write_text(f'<svg xmlns="http://www.w3.org/2000/svg" width="9" height="9">{content}</svg>')
    return path


def test_copies_of_a_drawing_are_counted_before_they_are_drawn(tmp_path: Path) -> None:
    nested = '<g id="g0"><path d="M0 0H9" stroke="#000"/></g>'
    for level in range(1, 12):
        nested += f'<g id="g{level}">' + f'<use href="#g{level - 1}"/>' * 10 + "</g>"
    with pytest.raises(ValueError, match="elements with their copies, must have at most 200000"):
        read_plan(svg_plan(tmp_path, nested), None, PlanOptions(resolution=0.02))
    itself = svg_plan(tmp_path, '<g id="g"><use href="#g"/></g>')
    with pytest.raises(ValueError, match="an element is a copy of itself"):
        read_plan(itself, None, PlanOptions(resolution=0.02))


def test_polygons_of_too_many_corners_are_refused(tmp_path: Path, monkeypatch) -> None:
    angles = np.linspace(0.0, 2.0 * np.pi, 20_000, endpoint=False)
    verts = np.column_stack((9.0 * np.cos(angles), 9.0 * np.sin(angles)))
    with pytest.raises(ValueError, match="has 20000 corners, must have at most 3000"):
        houseexpo_world("house", {"verts": verts.tolist()})
    monkeypatch.setattr("worlds.importing.svg.MAX_COMPARED", 100)
    with pytest.raises(ValueError, match="fills have more corners than can be compared"):
        read_plan(svg_plan(tmp_path, '<path d="M0 0L9 0L9 9Z"/>' * 12), None, PlanOptions(resolution=0.02))


def test_drawings_in_dxf_are_bounded(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr("worlds.importing.dxf.MAX_ENTITIES", 100)
    ezdxf = pytest.importorskip("ezdxf")
    for name, message in (("circle", "longer than 500 m"), ("b2", "more than 100 entities")):
        document = ezdxf.new()
        document.units = 6
        document.blocks.new("circle").add_circle((0, 0), 1e9)
        document.blocks.new("b0").add_line((0, 0), (1, 0))
        for level in range(1, 3):
            block = document.blocks.new(f"b{level}")
            for _ in range(11):
                block.add_blockref(f"b{level - 1}", (0, 0))
        document.modelspace().add_blockref(name, (0, 0))
        document.saveas(tmp_path / "plan.dxf")
        with pytest.raises(ValueError, match=message):
            read_plan(tmp_path / "plan.dxf", None, PlanOptions())


def test_a_cut_off_dxf_is_refused(tmp_path: Path) -> None:
    """The library raises StopIteration then."""
    path = tmp_path / "plan.dxf"
    path.write_text("0\nSECTION\n2\n")
    with pytest.raises(ValueError, match=r"plan\.dxf: is no DXF drawing"):
        read_plan(path, None, PlanOptions())
