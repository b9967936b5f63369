"""Study how the noise level affects merges: one setting varies, the missions and the random draws stay the same.

python examples/noise_study.py study
"""

import subprocess
import sys

LEVELS = "0,1,3"


def main(out: str) -> None:
    """Write the study to the new folder ``out``; ``success.png`` draws the share of right answers by noise level."""
    study = ["study", "--vary", f"sensing.noise={LEVELS}", "--set", "mission.duration=30", "--set", "mission.robots=2"]
    study += ["--world", "house", "--missions", "2", "--method", "quilt", "--method", "orb", "--out", out]
    subprocess.run([sys.executable, "-m", "mapquilt", *study], check=True)
    print(f"picture: {out}/success.png")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "study")
