"""Benchmark a method of your own: a proposer suggests transforms, everything else is common to all methods.

python examples/benchmark_your_own_method.py DATASET benchmark
"""

import math
import sys
from dataclasses import dataclass

import numpy as np

import mapquilt as mq


@dataclass(frozen=True)
class PrincipalAxes:
    """Propose the transforms that bring the principal axes of both maps' walls together: four rotations, one scale."""

    samples: int = 2000

    def describe(self, prepared: mq.PreparedMap) -> tuple[np.ndarray, float, float]:
        """Return centre (2,) [cells], direction [rad] and spread [cells] of the wall points of one map."""
        points = prepared.points[:: max(1, len(prepared.points) // self.samples)]
        values, vectors = np.linalg.eigh(np.cov(points.T))
        return points.mean(axis=0), math.atan2(vectors[1, 1], vectors[0, 1]), math.sqrt(values.sum())

    def propose(self, target, source, scale: mq.ScaleRange, rng: np.random.Generator) -> tuple[mq.Proposal, ...]:
        """Return transforms from cells of the source to cells of the target, with scales in the range."""
        size = scale.clip(target[2] / source[2])
        proposals = []
        for quarter in range(4):
            turn = mq.Similarity2(yaw=target[1] - source[1] + quarter * math.pi / 2, scale=size)
            x, y = target[0] - turn.apply(source[0])
            proposals.append(mq.Proposal(mq.Similarity2(x, y, turn.yaw, size)))
        return tuple(proposals)


def main(dataset: str, out: str) -> mq.BenchmarkResults:
    """Compare the method with the built-in ones on a data set; ``out`` holds tables and a picture of every pair."""
    mq.register_method("principal_axes", [PrincipalAxes()])
    results = mq.compare_methods(dataset, ["quilt", "orb", "principal_axes"], out=out)
    print(f"table: {out}/table.md, pictures: {out}/sheets/")
    return results


if __name__ == "__main__":
    main(*sys.argv[1:3])
