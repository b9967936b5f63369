"""``mapquilt score``."""

from __future__ import annotations

from mapquilt.cli.exit_status import ALL_MERGED
from mapquilt.cli.options.files import RunFolder
from mapquilt.cli.tables import print_table, score_table
from mapquilt.runs import folder as run_folder
from mapquilt.runs.stages import score_run


def score(run: RunFolder) -> int:
    """Compare a run's merge with the truth; write score.json and overview.png."""
    print_table(score_table(score_run(run_folder.require_run(run))))
    return ALL_MERGED
