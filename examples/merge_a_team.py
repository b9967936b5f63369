"""Simulate a team of four robots, merge their maps, and evaluate every pair against the ground truth.

python examples/merge_a_team.py team
"""

import sys

import mapquilt as mq


def main(out: str) -> tuple[mq.EvaluatedPair, ...]:
    """Write the run and its merge to the new folder ``out``; ``merge.png`` shows the merged map."""
    sample = mq.simulate("house", robots=4, seed=2, duration=60.0, out=out)
    result = mq.merge(out)
    print(f"{len(result.reference_from_map)} of {len(result.names)} maps merged, in the frame of {result.reference}")
    pairs = mq.evaluate(result, sample.maps, sample.truth)
    for one in pairs:
        error = "-" if one.error is None else f"{one.error.rotation_deg:.2f} deg"
        print(f"{one.pair.name:18} overlap {one.truth.overlap:.0%}  {one.outcome:12}  rotation error {error}")
    print(f"picture: {out}/merge.png")
    return pairs


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "team")
