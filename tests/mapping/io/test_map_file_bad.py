"""Bad map files: one line that names file, field and value; no traceback, no hang, no decompression bomb."""

from __future__ import annotations

import os
import struct
import tempfile
import tracemalloc
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image

from mapping.geometry.se2 import SE2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.io.map_file import load_map, save_map
from mapping.io.map_yaml import MAX_BYTES
from mapping.io.picture import read_picture

GOOD = "image: map.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a good map.pgm and map.png of 3 x 2 pixels, and a good map.yaml."""
    save_map(OccupancyGrid.from_occupancy(GridFrame(1.0, SE2(), (2, 3)), [[100, 0, -1]] * 2), tmp_path / "map")
    Image.fromarray(np.zeros((2, 3), np.uint8)).save(tmp_path / "map.png")
    (tmp_path / "map.yaml").write_text(GOOD)
    return tmp_path


def refusal(path: Path) -> str:
    with pytest.raises(ValueError, match=r"\S") as caught:
        load_map(path)
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith(f"{path.parent}/")
    assert len(message) < 500
    return message.removeprefix(f"{path.parent}/")


def test_the_good_map_is_good(folder: Path) -> None:
    assert load_map(folder / "map.yaml").warnings == ()
    load_map(folder / "map.png")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("image: map.pgm\n", "", "the YAML has no field image"),
        ("resolution: 0.05\n", "", "the YAML has no field resolution"),
        ("origin: [0, 0, 0]\n", "", "the YAML has no field origin"),
        ("0.05", "0", "resolution is 0.0, must be positive and finite"),
        ("0.05", "-0.05", "resolution is -0.05, must be positive and finite"),
        ("0.05", "nan", "resolution is nan, must be positive and finite"),
        ("0.05", ".NaN", "resolution is nan, must be positive and finite"),
        ("0.05", ".inf", "resolution is inf, must be positive and finite"),
        ("0.05", "1e300", "resolution is 1e+300 m, must lie between 1e-05 and 100000"),
        ("0.05", "1e-320", "resolution is 1e-320 m, must lie between 1e-05 and 100000"),
        ("0.05", "9" * 5000, "resolution is inf, must be positive and finite"),
        ("[0, 0, 0]", "[1e15, 0, 0]", "origin is 1000000000000000.0, 0.0 m, must lie within 1e+09 m"),
        ("[0, 0, 0]", "[0, -1e300, 0]", "origin is 0.0, -1e+300 m, must lie within 1e+09 m"),
        ("0.05", "fine", "resolution is 'fine', must be a number"),
        ("0.05", "'0,05'", "resolution is '0,05', must be a number"),
        ("0.05", "", "resolution is '', must be a number"),
        ("0.05", "[0.05]", "resolution is ['0.05'], must be a number"),
        ("[0, 0, 0]", "[0, 0]", "origin is ['0', '0'], must be a list of x, y, yaw"),
        ("[0, 0, 0]", "0", "origin is '0', must be a list of x, y, yaw"),
        ("[0, 0, 0]", "[0, here, 0]", "origin is 'here', must be a number"),
        ("[0, 0, 0]", "[nan, 0, 0]", "origin is ['nan', '0', '0'], must be finite"),
        ("[0, 0, 0]", "[0, 0, .inf]", "origin is ['0', '0', '.inf'], must be finite"),
        ("negate: 0", "negate: maybe", "negate is 'maybe', must be 0 or 1"),
        ("negate: 0", "negate: [1]", "negate is ['1'], must be 0 or 1"),
        ("0.65", "high", "occupied_thresh is 'high', must be a number"),
        ("0.196", "nan", "free_thresh is nan, must be finite"),
        ("negate: 0", "mode: binary", "mode is 'binary', must be trinary, scale or raw"),
        ("map.pgm", "''", "image is '', must be a name"),
        ("map.pgm", "[map.pgm]", "image is ['map.pgm'], must be a name"),
        ("map.pgm", "../other.pgm", "image is '../other.pgm', outside the YAML's folder"),
        ("map.pgm", "/etc/passwd", "image is '/etc/passwd', outside the YAML's folder"),
        ("map.pgm", "a/../../other.pgm", "image is 'a/../../other.pgm', outside the YAML's folder"),
        ("0.65", "65", "occupied_thresh is 65, must lie in 0 to 1; 65 looks like per cent, which is 0.65"),
        ("0.196", "-0.1", "free_thresh is -0.1, must lie in 0 to 1"),
        ("0.65", "0.1", "free_thresh is 0.196, must be at most occupied_thresh, 0.1; are the two swapped?"),
        ("map.pgm", '"map.pgm\\0"', r"image is 'map.pgm\x00', outside the YAML's folder"),
    ],
)
def test_a_bad_field_is_named_with_its_value(folder: Path, old: str, new: str, message: str) -> None:
    assert old in GOOD
    (folder / "map.yaml").write_text(GOOD.replace(old, new))
    assert refusal(folder / "map.yaml").startswith(f"map.yaml: {message}")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "message"),
    [
        (b"", "the file is empty"),
        (b"# nothing\n", "the YAML is None, not a map's fields"),
        (b"just words", "the YAML is 'just words', not a map's fields"),
        (b"- image: map.pgm\n", "the YAML is [{'image': 'map.pgm'}], not a map's fields"),
        (b"image: [", "not a YAML file: line 1, column 9: expected the node content, but found '<stream end>'"),
        (
            b"image: a.pgm\nresolution:0.05\norigin: [0, 0, 0]\n",
            "not a YAML file: line 2 is no field with its value; a ",
        ),
        (b"image: a.pgm\n---\nimage: b.pgm\n", "not a YAML file: a second document begins at line 2; keep one"),
        (
            b"map_server:\n  ros__parameters:\n    yaml_filename: m.yaml\n",
            "is a file of ROS parameters; give the map's",
        ),
        (b"image: \xff\xfe", "not a YAML file: "),
        (b"\x00\x01", "not a YAML file: "),
        ("image: a.pgm".encode("utf-16"), "the YAML is UTF-16, must be UTF-8"),
        (b"[" * 20_000, "not a YAML file: "),
        (b"{? {} : 1}", "not a YAML file: "),
        (b"resolution: 0.05\nresolution: 0.1\n", "the YAML has the field 'resolution' twice"),
        (b"#" * (MAX_BYTES + 1), "the file has 65537 bytes"),
    ],
)
def test_other_yaml_files_are_refused(folder: Path, text: bytes, message: str) -> None:
    (folder / "map.yaml").write_bytes(text)
    assert refusal(folder / "map.yaml").startswith(f"map.yaml: {message}")


def test_a_recursive_value_is_shortened_in_the_message(folder: Path) -> None:
    levels = "".join(f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]\n" for k in range(1, 40))
    (folder / "map.yaml").write_text("a0: &a0 [lol]\n" + levels + "resolution: *a39\nimage: x\norigin: [0,0,0]\n")
    assert refusal(folder / "map.yaml").startswith("map.yaml: resolution is [[[")


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "the file is empty"),
        (b"P5", "the PGM header is broken"),
        (b"P5 3 2", "the PGM header is broken"),
        (b"P5 3 x 255 ", "the PGM header is broken"),
        (b"P5 0 2 255 ", "the PGM is 0 x 2 pixels"),
        (b"P5 3 2 0 ", "the PGM's maxval is 0, must be 1 to 65535"),
        (b"P5 3 2 65536 ", "the PGM's maxval is 65536, must be 1 to 65535"),
        (b"P5 3 2 255\n12345", "the PGM is truncated: 3 x 2 pixels need 6 bytes, but 5 are there"),
        (b"P5 3 2 256\n" + bytes(11), "the PGM is truncated: 3 x 2 pixels need 12 bytes, but 11 are there"),
        (b"P5 1 1 100\n\xff", "a pixel of the PGM is 255, but its maxval is 100"),
        (b"P2 2 2 255\n1 2 3       ", "the PGM is truncated: 4 pixels are announced, 3 are there"),
        (b"P2 1 1 255\n256", "a pixel of the PGM is 256, but its maxval is 255"),
        (b"P2 1 1 255\n99999999999999999999999", "a pixel of the PGM is 9223372036854775807, but its maxval is 255"),
        (b"P2 2 1 255\n-1 2", "the plain PGM holds b'-' among its numbers"),
        (b"P5 100000 100000 255\n", "the picture has 100000 x 100000 pixels, more than the 134217728 that are read"),
        (
            b"image: m.pgm\nresolution: 0.05\n",
            "is no picture, but looks like the YAML of a map; give it a name that ends in .yaml",
        ),
        (b"GIF89a 12", "not a PGM, PNG, BMP, PPM, TIFF or JPEG picture; it starts with b'GIF89a 1'"),
        (b"\xff\xd8\xff\xe0 JFIF", "the JPEG is broken or truncated"),
        (b"BM too short", "the BMP is broken or truncated"),
        (b"P6 50000 50000 255\n", "the picture has more than the 134217728 pixels that are read"),
        (b"P6 12000 12000 255\n", "the picture has 12000 x 12000 pixels, more than the 134217728 that are read"),
        (b"P6 2 2 255\n123", "the PPM is broken or truncated"),
        (b"version https://git-lfs.github.com/spec/v1\n", "is a pointer of Git LFS, not the picture"),
        (b"\x89PNG\r\n\x1a\n", "the PNG header is broken"),
    ],
)
def test_a_bad_picture_is_refused(folder: Path, data: bytes, message: str) -> None:
    (folder / "map.pgm").write_bytes(data)
    for path in (folder / "map.yaml", folder / "map.pgm"):
        assert refusal(path).startswith(f"map.pgm: {message}")


def test_a_truncated_png_is_refused_wherever_it_ends(folder: Path) -> None:
    data = (folder / "map.png").read_bytes()
    for size in range(1, len(data) - 4):  # only the closing chunk's checksum may be missing
        (folder / "map.png").write_bytes(data[:size])
        assert refusal(folder / "map.png").startswith("map.png: ")


def test_a_png_bomb_is_refused_before_it_is_decoded(folder: Path) -> None:
    def chunk(kind: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    header = chunk(b"IHDR", struct.pack(">IIBBBBB", 50_000, 50_000, 8, 0, 0, 0, 0))
    bomb = b"\x89PNG\r\n\x1a\n" + header + chunk(b"IDAT", zlib.compress(bytes(10**7))) + chunk(b"IEND", b"")
    (folder / "map.png").write_bytes(bomb)
    tracemalloc.start()
    message = refusal(folder / "map.png")
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert message.startswith("map.png: the picture has 50000 x 50000 pixels")
    assert peak < 5e6


def test_missing_files_are_named(folder: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"none\.yaml"):
        load_map(folder / "none.yaml")
    (folder / "map.pgm").unlink()
    with pytest.raises(FileNotFoundError) as caught:
        load_map(folder / "map.yaml")
    assert str(caught.value) == f"{folder / 'map.yaml'}: image map.pgm: no such file"


def test_folders_and_devices_are_refused(folder: Path) -> None:
    (folder / "dir.yaml").mkdir()
    assert refusal(folder / "dir.yaml") == "dir.yaml: not a file"
    (folder / "map.pgm").unlink()
    (folder / "map.pgm").symlink_to("/dev/zero")
    assert "or a link that leads out" in refusal(folder / "map.yaml")
    (folder / "map.pgm").unlink()
    os.mkfifo(folder / "map.pgm")
    assert refusal(folder / "map.yaml") == "map.pgm: not a file"


@pytest.mark.parametrize("grey", [-1, 256])
def test_an_unknown_grey_out_of_range_is_refused(folder: Path, grey: int) -> None:
    with pytest.raises(ValueError, match=f"unknown_grey is {grey}, must be 0 to 255"):
        load_map(folder / "map.yaml", unknown_grey=grey)


def grown(data: bytes) -> st.SearchStrategy[bytes]:
    """Mutations of a good file: bytes overwritten, cut out, put in, the end cut off."""
    position = st.integers(0, len(data))
    piece = st.one_of(st.binary(max_size=4), st.sampled_from([b"9" * 9, b"\n", b"#", b"[", b"&a", b"*a", b"nan", b"-"]))
    edit = st.tuples(position, position, piece)

    def apply(edits: list[tuple[int, int, bytes]]) -> bytes:
        result = data
        for start, length, new in edits:
            result = result[:start] + new + result[start + length % 8 :]
        return result

    return st.lists(edit, min_size=1, max_size=4).map(apply)


def good_files() -> dict[str, bytes]:
    with tempfile.TemporaryDirectory() as name:
        rng = np.random.default_rng(3)
        grid = OccupancyGrid(GridFrame(0.05, SE2(1.0, 2.0, 0.3), (9, 7)), rng.normal(size=(9, 7)))
        save_map(grid, Path(name) / "map", mode="scale", picture="png")
        save_map(grid, Path(name) / "map")
        plain = b"P2\n# plain\n3 2\n255\n0 254 205\n254 254 0\n"
        return {path.name: path.read_bytes() for path in Path(name).iterdir()} | {"plain.pgm": plain}


FILES = good_files()
FUZZ = settings(max_examples=300, deadline=2000, suppress_health_check=[HealthCheck.too_slow])


def assert_read_or_refused(name: str, data: bytes) -> None:
    with tempfile.TemporaryDirectory() as folder:
        for other, good in FILES.items():
            (Path(folder) / other).write_bytes(good)
        path = Path(folder) / name
        path.write_bytes(data)
        try:
            grid = load_map(path).grid
        except (ValueError, OSError) as error:
            assert "\n" not in str(error)
            assert folder in str(error)
        else:
            assert grid.log_odds.shape == grid.frame.shape


def fuzz(name: str) -> Callable[[], None]:
    @FUZZ
    @given(st.one_of(grown(FILES[name]), st.binary(max_size=200)))
    def test(data: bytes) -> None:
        assert_read_or_refused(name, data)

    return test


test_fuzzed_yaml = fuzz("map.yaml")
test_fuzzed_pgm = fuzz("map.pgm")
test_fuzzed_plain_pgm = fuzz("plain.pgm")
test_fuzzed_png = fuzz("map.png")


def test_an_image_whose_name_differs_by_capitals_is_named(tmp_path):
    (tmp_path / "m.pgm").write_bytes(b"P5 1 1 255 a")
    path = tmp_path / "map.yaml"
    path.write_text("image: M.PGM\nresolution: 0.05\norigin: [0, 0, 0]\n")
    with pytest.raises(FileNotFoundError, match=r"image M\.PGM: no such file; m\.pgm is there: correct the capitals"):
        load_map(path)


@pytest.mark.parametrize("mode", ["RGBA", "I;16", "P", "LA", "RGB", "1"])
def test_a_picture_is_converted_by_bands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, mode: str) -> None:
    """A colour picture of 0.5 MB unpacks to 0.5 GB; converted as a whole it took 1.8 GB."""
    values = np.random.default_rng(1).integers(0, 256, (13, 7, 4), dtype=np.uint8)
    deep = Image.fromarray(values[..., 0].astype(np.uint16) * 257)
    image = deep if mode == "I;16" else Image.fromarray(values, "RGBA").convert(mode)
    image.save(tmp_path / "map.png")
    whole = read_picture(tmp_path / "map.png")
    monkeypatch.setattr("mapping.io.picture._BAND_PIXELS", 20)
    bands = read_picture(tmp_path / "map.png")
    assert np.array_equal(whole.grey, bands.grey)
    assert (whole.opaque is None) == (bands.opaque is None) == (mode not in ("RGBA", "LA", "P"))
    assert whole.opaque is None or np.array_equal(whole.opaque, bands.opaque)
    assert len(np.unique(whole.grey)) > 1
