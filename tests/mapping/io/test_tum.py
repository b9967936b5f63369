"""TUM trajectories: round trips and refusals."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mapping.io.tum import load_tum, save_tum
from mapping.robot.trajectory import Trajectory


def test_the_round_trip(tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    poses = np.column_stack((rng.normal(size=(50, 2)) * 30.0, rng.uniform(-math.pi, math.pi, 50)))
    walked = Trajectory(1.6e9 + np.cumsum(rng.uniform(0.05, 0.2, 50)), poses)
    save_tum(tmp_path / "path.tum", walked)
    again = load_tum(tmp_path / "path.tum")
    np.testing.assert_array_equal(again.stamps, walked.stamps)
    np.testing.assert_array_equal(again.poses[:, :2], walked.poses[:, :2])
    np.testing.assert_allclose(again.poses[:, 2], walked.poses[:, 2], atol=1e-14)


def test_the_quaternion_rotates_x_to_the_heading(tmp_path: Path) -> None:
    save_tum(tmp_path / "path.tum", Trajectory([0.5], [[1.0, 2.0, 2.5]]))
    stamp, x, y, z, *quaternion = (float(word) for word in (tmp_path / "path.tum").read_text().splitlines()[-1].split())
    assert (stamp, x, y, z) == (0.5, 1.0, 2.0, 0.0)
    forward = Rotation.from_quat(quaternion).apply([1.0, 0.0, 0.0])  # scalar last, as TUM has it
    np.testing.assert_allclose(forward, [math.cos(2.5), math.sin(2.5), 0.0], atol=1e-15)


def test_a_tilted_pose_keeps_its_yaw(tmp_path: Path) -> None:
    quaternion = 3.0 * Rotation.from_euler("ZYX", [0.7, 0.2, -0.3]).as_quat()
    (tmp_path / "path.tum").write_text(f"# by hand\n0 1 2 3 {' '.join(map(str, quaternion))}\n\n")
    np.testing.assert_allclose(load_tum(tmp_path / "path.tum").poses, [[1.0, 2.0, 0.7]])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "the file is empty"),
        ("# only words\n", "no pose"),
        ("0 1 2 3 0 0 0\n", "line 1 is '0 1 2 3 0 0 0', must be eight numbers"),
        ("# x\n0 1 2 a 0 0 0 1\n", "line 2 is '0 1 2 a 0 0 0 1', must be eight numbers"),
        ("0 1 2 3 0 0 0 0\n", "line 1 has a quaternion of 0"),
        ("0 nan 2 3 0 0 0 1\n", "Trajectory: poses holds a number that is not finite"),
        ("1 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n", "Trajectory: stamp 1.0 s does not come after 1.0 s"),
    ],
)
def test_a_bad_file_is_refused_by_name(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "path.tum"
    path.write_text(text)
    with pytest.raises(ValueError, match=r"path\.tum") as caught:
        load_tum(path)
    assert str(caught.value) == f"{path}: {message}"
