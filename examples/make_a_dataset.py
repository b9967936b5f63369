"""Make a small data set of map pairs with ground truth, and read it as a training loop would.

python examples/make_a_dataset.py pairs
"""

import subprocess
import sys
from pathlib import Path

import mapquilt as mq

SPECIFICATION = """\
name: example
seed: 1
missions:
  - {world: office, count: 2, robots: 2, duration: 30}
  - {world: cave, count: 2, robots: 2, duration: 30}
samples:
  per_mission: 2
  noise: [0, 1]
  set: {lidar.dropout: [0, 0.1]}
splits: {train: 0.5, test: 0.5}
"""


def main(out: str) -> int:
    """Make the data set in the new folder ``out``, and return the number of pairs in its training split."""
    file = Path(f"{out}.yaml")
    file.write_text(SPECIFICATION)
    subprocess.run([sys.executable, "-m", "mapquilt", "dataset", "make", str(file), "--out", out], check=True)
    pairs = mq.load_dataset(out, split="train").pairs
    for pair in pairs:
        print(pair.name, f"overlap {pair.overlap:.2f}", pair.target.log_odds.shape, pair.target_from_source)
    print(f"picture of a sample: {out}/samples/000000/preview.png")
    return len(pairs)


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "pairs")
