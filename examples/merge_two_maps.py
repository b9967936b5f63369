"""Merge two map files and draw the result.

    python examples/merge_two_maps.py floor_a.yaml floor_b.yaml merged

Without arguments it draws two maps of a simulated office first.
"""

import sys
import tempfile
from pathlib import Path

import mapquilt as mq


def main(first: str | Path, second: str | Path, out: str | Path) -> mq.MergeResult:
    """Merge two files into the new folder ``out``; its ``merge.png`` shows both maps and the merged one."""
    result = mq.merge([first, second], out=out)
    pair = result.pairs[0]
    print(f"accepted: {pair.accepted}, confidence {pair.confidence:.2f}{f' ({pair.refusal})' if pair.refusal else ''}")
    print(f"transform of {pair.source} to {pair.target}: {pair.target_from_source}")
    print(f"picture: {Path(out) / 'merge.png'}")
    return result


if __name__ == "__main__":
    if len(sys.argv) == 4:
        main(*sys.argv[1:])
    else:
        folder = Path(tempfile.mkdtemp(prefix="mapquilt-"))
        honest = mq.SampleSettings(mq.SensingSettings(noise=0.5), perturbation=mq.FramePerturbationRanges(1.0, 1.0))
        team = mq.simulate("office", robots=2, seed=3, duration=60.0, sampling=honest)
        for name, grid in zip(team.maps.names, team.maps.grids, strict=True):
            mq.save_map(grid, folder / name)
        main(folder / "robot_0.yaml", folder / "robot_1.yaml", folder / "merged")
