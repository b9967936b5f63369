"""Map files: exact round trips, and pixels are read as by nav2's map_server."""

from __future__ import annotations

import math
import struct
import tempfile
from pathlib import Path
from typing import Literal

import cv2
import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from PIL import Image

from mapping.geometry.se2 import SE2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.io.map_file import load_map, require_known, save_map
from mapping.io.map_yaml import FARTHEST_ORIGIN, LARGEST_RESOLUTION, SMALLEST_RESOLUTION, Mode
from mapping.io.occupancy_grey import percent
from mapping.io.picture import read_picture

DEFAULTS: dict[str, object] = {
    "image": "map.pgm",
    "resolution": 0.05,
    "origin": [0.0, 0.0, 0.0],
    "negate": 0,
    "occupied_thresh": 0.65,
    "free_thresh": 0.196,
}


def write_map(folder: Path, grey: np.ndarray, *, image: str = "map.pgm", **fields: object) -> Path:
    """A map as another program would write it: picture by OpenCV, YAML by hand."""
    ok, data = cv2.imencode(Path(image).suffix, grey)
    assert ok
    (folder / image).write_bytes(data.tobytes())
    path = folder / "map.yaml"
    path.write_text("".join(f"{key}: {value}\n" for key, value in (DEFAULTS | {"image": image} | fields).items()))
    return path


def nav2_cell(grey: int, alpha: int, mode: str, negate: bool, occupied: float, free: float) -> int:
    """One pixel through nav2's map_io.cpp since its pull request 5071, slowly: single precision, both thresholds
    inclusive, halves rounded up. Before it, alpha was averaged into the colours in trinary mode."""
    single = lambda number: struct.unpack("f", struct.pack("f", number))[0]  # noqa: E731
    if mode == "raw":
        return grey if grey <= 100 else -1
    if alpha < 255:
        return -1
    p = single(grey / 255.0)
    if not negate:
        p = single(1.0 - p)
    value = -1
    if p >= single(occupied):
        value = 100
    if p <= single(free):
        value = 0
    if mode == "scale" and single(free) < p < single(occupied):
        share = single(single(single(p - single(free)) / single(occupied - free)) * 100.0)
        value = math.floor(share) + (share - math.floor(share) >= 0.5)
    return value


def loaded_cells(path: Path, mode: str, **options: int) -> np.ndarray:
    grid = load_map(path, **options).grid
    return grid.occupancy() if mode == "trinary" else percent(grid)


@pytest.mark.parametrize("mode", ["trinary", "scale", "raw"])
@pytest.mark.parametrize("negate", [0, 1])
@pytest.mark.parametrize(("occupied", "free"), [(0.65, 0.196), (0.65, 0.25), (0.8, 0.1), (1.0, 0.0), (0.5, 0.5)])
def test_every_grey_reads_as_in_nav2(tmp_path: Path, mode: str, negate: int, occupied: float, free: float) -> None:
    grey = np.arange(256, dtype=np.uint8).reshape(16, 16)
    path = write_map(tmp_path, grey, mode=mode, negate=negate, occupied_thresh=occupied, free_thresh=free)
    wanted = [[nav2_cell(int(v), 255, mode, bool(negate), occupied, free) for v in row] for row in grey[::-1]]
    np.testing.assert_array_equal(loaded_cells(path, mode), wanted)


@pytest.mark.slow
@given(
    thresholds=st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 1.0)).map(lambda two: (max(two), min(two))),
    mode=st.sampled_from(["trinary", "scale"]),
    negate=st.booleans(),
)
def test_any_thresholds_read_as_in_nav2(thresholds: tuple[float, float], mode: str, negate: bool) -> None:
    occupied, free = thresholds
    grey = np.arange(256, dtype=np.uint8)[None]
    with tempfile.TemporaryDirectory() as folder:
        fields = {"mode": mode, "negate": int(negate), "occupied_thresh": occupied, "free_thresh": free}
        cells = loaded_cells(write_map(Path(folder), grey, **fields), mode)
    assert cells[0].tolist() == [nav2_cell(v, 255, mode, negate, occupied, free) for v in range(256)]


@pytest.mark.parametrize("mode", ["trinary", "scale", "raw"])
def test_transparent_pixels_are_unknown_except_in_raw_mode(tmp_path: Path, mode: str) -> None:
    alphas, greys = np.meshgrid([0, 1, 128, 254, 255], [0, 60, 120, 205, 254], indexing="ij")
    pixels = np.stack((greys, greys, greys, alphas), axis=-1).astype(np.uint8)
    path = write_map(tmp_path, pixels, image="map.png", mode=mode)
    wanted = [
        [nav2_cell(int(g), int(a), mode, False, 0.65, 0.196) for g, a in zip(*rows, strict=True)]
        for rows in zip(greys[::-1], alphas[::-1], strict=True)
    ]
    np.testing.assert_array_equal(loaded_cells(path, mode), wanted)


def test_fifty_per_cent_is_known(tmp_path: Path) -> None:
    path = write_map(tmp_path, np.array([[50, 255]], dtype=np.uint8), mode="raw")
    assert load_map(path).grid.known.tolist() == [[True, False]]


@pytest.mark.parametrize("mode", ["scale", "raw"])
def test_more_per_cent_is_more_log_odds(tmp_path: Path, mode: Mode) -> None:
    path = write_map(tmp_path, np.arange(101, dtype=np.uint8)[None], mode="raw")
    grid = load_map(path).grid
    assert (np.diff(grid.log_odds[0]) > 0).all()
    save_map(grid, tmp_path / "again", mode=mode, picture="png")
    np.testing.assert_array_equal(load_map(tmp_path / "again.yaml").grid.log_odds, grid.log_odds)


# --- Where the pixels are ---


def test_the_only_pixel_is_the_only_cell(tmp_path: Path) -> None:
    grid = load_map(write_map(tmp_path, np.array([[0]], dtype=np.uint8), origin=[3.0, -2.0, 0.0], resolution=0.5)).grid
    assert grid.occupancy().tolist() == [[100]]
    np.testing.assert_allclose(grid.frame.metres_from_cells([[0, 0]]), [[3.25, -1.75]])


def test_two_rows_of_three_pixels(tmp_path: Path) -> None:
    grey = np.array([[254, 205, 254], [0, 254, 205]], dtype=np.uint8)  # top row first
    grid = load_map(write_map(tmp_path, grey, resolution=1.0)).grid
    assert grid.occupancy().tolist() == [[100, 0, -1], [0, -1, 0]]  # row 0 lowest
    height = grey.shape[0]
    metre = grid.frame.metre_from_pixel() @ [0, height - 1, 1]
    assert grid.frame.cells_from_metres(metre[:2]).tolist() == [0, 0]
    np.testing.assert_allclose(metre[:2], [0.5, 0.5])


def test_the_written_picture_has_the_lowest_row_last(tmp_path: Path) -> None:
    frame = GridFrame(0.1, SE2(), (2, 3))
    save_map(OccupancyGrid.from_occupancy(frame, [[100, 0, -1], [0, -1, 0]]), tmp_path / "map")
    assert (tmp_path / "map.pgm").read_bytes() == b"P5\n3 2\n255\n" + bytes([254, 205, 254, 0, 254, 205])
    read_by_opencv = cv2.imread(str(tmp_path / "map.pgm"), cv2.IMREAD_UNCHANGED)
    assert read_by_opencv.tolist() == [[254, 205, 254], [0, 254, 205]]


# --- Round trips ---

positive = st.floats(SMALLEST_RESOLUTION, LARGEST_RESOLUTION)
finite = st.floats(-FARTHEST_ORIGIN, FARTHEST_ORIGIN)
origins = st.builds(SE2, finite, finite, st.floats(-math.pi, math.pi))
shapes = st.tuples(st.integers(1, 6), st.integers(1, 6))


@st.composite
def grids(draw: st.DrawFn) -> OccupancyGrid:
    shape = draw(shapes)
    log_odds = draw(hnp.arrays(np.float32, shape, elements=st.floats(-10, 10, width=32)))
    return OccupancyGrid(GridFrame(draw(positive), draw(origins), shape), log_odds)


@pytest.mark.slow
@given(
    grids(), st.sampled_from([("trinary", "pgm"), ("trinary", "png"), ("scale", "png"), ("raw", "pgm"), ("raw", "png")])
)
def test_a_saved_map_is_read_back(grid: OccupancyGrid, kind: tuple[Mode, Literal["pgm", "png"]]) -> None:
    mode, picture = kind
    with tempfile.TemporaryDirectory() as folder:
        save_map(grid, Path(folder) / "a.b c", mode=mode, picture=picture)
        assert {path.name for path in Path(folder).iterdir()} == {f"a.b c.{picture}", "a.b c.yaml"}
        loaded = load_map(Path(folder) / "a.b c.yaml")
    assert loaded.grid.frame == grid.frame  # every bit of resolution, origin and yaw
    np.testing.assert_array_equal(loaded.grid.occupancy(), grid.occupancy())
    if mode != "trinary":
        np.testing.assert_array_equal(percent(loaded.grid), percent(grid))
    assert (loaded.unit, loaded.name, loaded.warnings) == ("m", "a.b c", ())


def test_the_yaml_has_the_fields_of_map_server(tmp_path: Path) -> None:
    frame = GridFrame(0.0537, SE2(-12.3456789012345, 1e-7, 0.7853981633974483), (1, 2))
    save_map(OccupancyGrid.from_occupancy(frame, [[100, -1]]), tmp_path / "map")
    assert yaml.safe_load((tmp_path / "map.yaml").read_text()) == {
        "image": "map.pgm",
        "mode": "trinary",
        "resolution": 0.0537,
        "origin": [-12.3456789012345, 1e-7, 0.7853981633974483],
        "negate": 0,
        "occupied_thresh": 0.65,
        "free_thresh": 0.196,
    }


@pytest.mark.parametrize(("mode", "picture"), [("trinary", "pgm"), ("scale", "png"), ("raw", "pgm")])
def test_equal_grids_give_equal_bytes(tmp_path: Path, mode: Mode, picture: Literal["pgm", "png"]) -> None:
    rng = np.random.default_rng(1)
    log_odds = rng.normal(size=(40, 30)).round(1)
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        save_map(
            OccupancyGrid(GridFrame(0.05, SE2(), (40, 30)), log_odds),
            tmp_path / name / "map",
            mode=mode,
            picture=picture,
        )
    for file in (tmp_path / "a").iterdir():
        assert file.read_bytes() == (tmp_path / "b" / file.name).read_bytes()


def test_scale_mode_needs_a_png(tmp_path: Path) -> None:
    grid = OccupancyGrid.from_occupancy(GridFrame(0.05, SE2(), (1, 1)), [[-1]])
    with pytest.raises(ValueError, match="PGM has no transparency"):
        save_map(grid, tmp_path / "map", mode="scale")
    assert not list(tmp_path.iterdir())


# --- Odd but readable ---


@pytest.mark.parametrize("nan", ["nan", "NaN", ".nan", "-.NaN"])
def test_a_yaw_of_nan_is_zero_with_a_warning(tmp_path: Path, nan: str) -> None:
    loaded = load_map(write_map(tmp_path, np.zeros((2, 2), np.uint8), origin=f"[1.5, -2, {nan}]"))
    assert loaded.grid.frame.origin == SE2(1.5, -2.0, 0.0)
    assert loaded.warnings == ("the origin's yaw is NaN; 0 is used",)


@pytest.mark.parametrize(
    "image",
    [
        *("/home/user/maps/map.pgm", "maps/map.pgm", "../map.pgm", "~/maps/map.pgm", "file:///maps/map.pgm"),
        *("package://nav/maps/map.pgm", "C:\\\\maps\\\\map.pgm"),
    ],
)
def test_a_picture_that_is_not_where_the_yaml_says_is_taken_from_beside_it(tmp_path: Path, image: str) -> None:
    path = write_map(tmp_path, np.array([[254, 0]], np.uint8))
    path.write_text(path.read_text().replace("map.pgm", f'"{image}"'))
    loaded = load_map(path)
    assert loaded.grid.occupancy().tolist() == [[0, 100]]
    (warning,) = loaded.warnings
    assert warning.endswith("map.pgm beside the YAML is read instead")


def test_a_picture_outside_the_folder_is_never_read(tmp_path: Path) -> None:
    """The picture beside the YAML is read, although the one that the YAML names exists too."""
    inside = tmp_path / "inside"
    inside.mkdir()
    Image.fromarray(np.array([[0, 0]], np.uint8)).save(tmp_path / "map.pgm")
    path = write_map(inside, np.array([[254, 0]], np.uint8))
    path.write_text(path.read_text().replace("map.pgm", str(tmp_path / "map.pgm")))
    assert load_map(path).grid.occupancy().tolist() == [[0, 100]]


@pytest.mark.parametrize(("ending", "warns"), [("bmp", 0), ("ppm", 0), ("tif", 0), ("jpg", 1)])
def test_other_pictures_are_read_whatever_their_extension(tmp_path: Path, ending: str, warns: int) -> None:
    grey = np.repeat(np.repeat(np.array([[205, 0], [254, 205]], np.uint8), 16, axis=0), 16, axis=1)
    path = write_map(tmp_path, grey)
    Image.fromarray(grey).convert("RGB").save(tmp_path / f"other.{ending}")
    (tmp_path / f"other.{ending}").rename(tmp_path / "map.pgm")
    loaded = load_map(path)
    assert loaded.grid.occupancy()[::16, ::16].tolist() == [[0, -1], [-1, 100]]
    assert len(loaded.warnings) == warns


def test_tabs_and_line_ends_of_windows_are_read(tmp_path: Path) -> None:
    path = write_map(tmp_path, np.array([[254, 0]], np.uint8))
    path.write_bytes(path.read_bytes().replace(b": ", b":\t").replace(b"\n", b"\r\n"))
    (tmp_path / "map.pgm").write_bytes(b"P5\r\n2 1\r\n255\r\n" + bytes((254, 0)))
    loaded = load_map(path)
    assert (loaded.grid.occupancy().tolist(), loaded.warnings) == ([[0, 100]], ())


@pytest.mark.parametrize("mode", ["trinary", "scale"])
def test_free_grey_205_gives_one_warning_and_can_be_overridden(tmp_path: Path, mode: str) -> None:
    """A picture of other greys than the saver's: a grey of 230 was drawn by hand."""
    grey = np.array([[205, 205, 254, 0, 230]], dtype=np.uint8)
    path = write_map(tmp_path, grey, free_thresh=0.25, mode=mode)
    loaded = load_map(path)
    assert loaded.grid.occupancy().tolist() == [[0, 0, 0, 100, 0]]
    (warning,) = loaded.warnings
    assert "205" in warning
    assert "free_thresh of 0.25" in warning
    assert "--unknown 205" in warning
    overridden = load_map(path, unknown_grey=205)
    assert overridden.grid.occupancy().tolist() == [[-1, -1, 0, 100, 0]]
    assert overridden.warnings == ()


@pytest.mark.parametrize("greys", [[205, 205, 254, 0], [205, 254, 254, 205]])
def test_the_unknown_grey_of_the_ros_2_saver_is_unknown_although_its_threshold_says_free(
    tmp_path: Path, greys: list[int]
) -> None:
    path = write_map(tmp_path, np.array([greys], dtype=np.uint8), free_thresh=0.25)
    loaded = load_map(path)
    assert loaded.grid.occupancy().tolist() == [[{205: -1, 254: 0, 0: 100}[grey] for grey in greys]]
    (warning,) = loaded.warnings
    assert "--unknown none" in warning
    as_nav2 = load_map(path, unknown_grey="none")
    assert as_nav2.grid.occupancy().tolist() == [[{205: 0, 254: 0, 0: 100}[grey] for grey in greys]]
    assert len(as_nav2.warnings) == 1


def test_grey_205_beside_walls_alone_stays_free(tmp_path: Path) -> None:
    """Without a lighter grey, 205 is what the drawing has for free."""
    loaded = load_map(write_map(tmp_path, np.array([[205, 0]], np.uint8), free_thresh=0.25))
    assert loaded.grid.occupancy().tolist() == [[0, 100]]


def test_unknown_or_absent_grey_205_gives_no_warning(tmp_path: Path) -> None:
    assert load_map(write_map(tmp_path, np.array([[205, 0]], np.uint8))).warnings == ()
    assert load_map(write_map(tmp_path, np.array([[254, 0]], np.uint8), free_thresh=0.25)).warnings == ()
    transparent = np.array([[[205, 205, 205, 0], [0, 0, 0, 255]]], np.uint8)
    assert load_map(write_map(tmp_path, transparent, image="map.png", mode="scale")).warnings == ()


def test_missing_thresholds_have_defaults_and_give_a_warning(tmp_path: Path) -> None:
    path = write_map(tmp_path, np.array([[205, 254, 0]], np.uint8))
    path.write_text("image: map.pgm\nresolution: 0.1\norigin: [0, 0, 0]\n")
    loaded = load_map(path)
    assert loaded.grid.occupancy().tolist() == [[-1, 0, 100]]
    assert loaded.warnings == (
        "no field occupied_thresh; 0.65 is used",
        "no field free_thresh; 0.196 is used",
    )


@pytest.mark.parametrize(("text", "negate"), [("0", False), ("1", True), ("true", True), ("no", False), ("Yes", True)])
def test_negate_is_a_number_or_a_word(tmp_path: Path, text: str, negate: bool) -> None:
    grid = load_map(write_map(tmp_path, np.array([[0]], np.uint8), negate=text)).grid
    assert grid.occupancy().tolist() == [[0 if negate else 100]]


@pytest.mark.parametrize("image", ["map.pgm", "map.png"])
def test_the_unit_of_a_bare_picture_is_cells(tmp_path: Path, image: str) -> None:
    write_map(tmp_path, np.array([[0, 205], [254, 254]], np.uint8), image=image)
    loaded = load_map(tmp_path / image)
    assert loaded.unit == "cell"
    assert loaded.grid.frame == GridFrame(1.0, SE2(), (2, 2))
    assert loaded.grid.occupancy().tolist() == [[0, 0], [100, -1]]


def test_an_absolute_image_inside_the_folder_is_read(tmp_path: Path) -> None:
    path = write_map(tmp_path, np.array([[0]], np.uint8))
    path.write_text(path.read_text().replace("map.pgm", str(tmp_path / "map.pgm")))
    assert load_map(path).grid.occupancy().tolist() == [[100]]


def test_an_image_in_a_folder_below_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "pictures").mkdir()
    path = write_map(tmp_path, np.array([[0]], np.uint8), image="pictures/map.pgm")
    monkeypatch.chdir(tmp_path)
    for name in (path, Path("map.yaml"), Path("pictures/../map.yaml")):
        assert load_map(name).grid.occupancy().tolist() == [[100]]


def test_a_link_is_followed_inside_the_folder_only(tmp_path: Path) -> None:
    (tmp_path / "maps").mkdir()
    path = write_map(tmp_path / "maps", np.array([[0]], np.uint8))
    picture = tmp_path / "maps" / "map.pgm"
    picture.rename(tmp_path / "maps" / "other.pgm")
    picture.symlink_to("other.pgm")
    assert load_map(path).grid.occupancy().tolist() == [[100]]
    (tmp_path / "maps" / "other.pgm").rename(tmp_path / "elsewhere.pgm")
    picture.unlink()
    picture.symlink_to("../elsewhere.pgm")
    with pytest.raises(ValueError, match=r"outside the YAML's folder or a link that leads out"):
        load_map(path)


@pytest.mark.parametrize(
    ("pgm", "grey"),
    [
        (b"P5 2 1 255\n\x00\xff", [0, 255]),
        (b"P5\n# by hand\n2# wide\n 1\n# high\n255\n\x0a\x20", [10, 32]),
        (b"P5 2 1 100 \x00\x64", [0, 255]),
        (b"P5 3 1 65535 \x00\x00\xff\xff\x80\x80", [0, 255, 128]),
        (b"P5 2 1 1000 \x01\xf4\x03\xe8", [128, 255]),
        (b"P2\n2 1\n255\n0 255\n", [0, 255]),
        (b"P2 2 1 10 # ten\n 5 # five\n 10", [128, 255]),
        (b"P5 2 1 255\n\x01\x02trailing", [1, 2]),
    ],
)
def test_pgms_of_every_kind(tmp_path: Path, pgm: bytes, grey: list[int]) -> None:
    (tmp_path / "map.pgm").write_bytes(pgm)
    raw = tmp_path / "map.yaml"
    raw.write_text("image: map.pgm\nresolution: 1\norigin: [0,0,0]\nmode: scale\noccupied_thresh: 1\nfree_thresh: 0\n")
    wanted = [nav2_cell(value, 255, "scale", False, 1.0, 0.0) for value in grey]
    assert percent(load_map(raw).grid)[0].tolist() == wanted


def test_a_16_bit_png_is_scaled_down(tmp_path: Path) -> None:
    path = write_map(tmp_path, np.array([[0, 65535, 205 * 257]], np.uint16), image="map.png")
    assert load_map(path).grid.occupancy().tolist() == [[100, 0, -1]]


def test_a_16_bit_pixel_is_read_by_both_its_bytes(tmp_path: Path) -> None:
    Image.fromarray(np.array([[0x00FF, 0x80FF, 0xFF00]], np.uint16)).save(tmp_path / "map.png")
    assert read_picture(tmp_path / "map.png").grey.tolist() == [[1, 128, 254]]


def test_a_palette_png_is_read_by_its_colours(tmp_path: Path) -> None:
    path = write_map(tmp_path, np.zeros((1, 3), np.uint8), image="map.png")
    image = Image.fromarray(np.array([[0, 1, 2]], np.uint8))
    image.putpalette([205, 205, 205, 254, 254, 254, 0, 0, 0])
    image.save(tmp_path / "map.png")
    assert load_map(path).grid.occupancy().tolist() == [[-1, 0, 100]]


def test_a_one_bit_png_is_black_and_white(tmp_path: Path) -> None:
    path = write_map(tmp_path, np.zeros((1, 2), np.uint8), image="map.png")
    Image.fromarray(np.array([[True, False]])).save(tmp_path / "map.png")
    assert load_map(path).grid.occupancy().tolist() == [[0, 100]]


def test_require_known_refuses_a_map_without_known_cells(tmp_path: Path) -> None:
    empty = load_map(write_map(tmp_path, np.full((2, 2), 205, np.uint8)))
    with pytest.raises(ValueError, match=r"map\.yaml: every cell of the map is unknown"):
        require_known(empty)
    known = load_map(write_map(tmp_path, np.array([[205, 254]], np.uint8)))
    assert require_known(known) is known


def test_a_picture_beside_its_yaml_gives_a_warning(tmp_path: Path) -> None:
    write_map(tmp_path, np.array([[0, 254]], np.uint8))
    (warning,) = load_map(tmp_path / "map.pgm").warnings
    assert "map.yaml beside it" in warning
    (tmp_path / "map.yaml").unlink()
    assert load_map(tmp_path / "map.pgm").warnings == ()
