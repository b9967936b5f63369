"""Keep simulated missions in a folder, one for each world, settings and seed."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import re
from dataclasses import dataclass
from functools import cache
from importlib import resources
from importlib.metadata import version
from pathlib import Path

from filelock import FileLock

from mapping.io.atomic import write_bytes_atomically
from mapping.io.safe_load import read_json
from mapping.io.transaction import atomic_folder
from mapquilt.jobs.code_version import code_digest
from mapquilt.json_file import to_text
from sim.mission.file import load_mission, save_mission
from sim.mission.mission import Mission
from sim.mission.settings import MissionSettings
from sim.mission.simulation import simulate
from worlds.world import World
from worlds.world_file import world_to_json

SCHEMA = "mapquilt-mission-cache/1"
MARK_FILE = "cache.json"
HASHES_FILE = "hashes.json"
ROOMS = ("mapping", "worlds", "sim")
"""Packages whose code determines a mission; a change in them invalidates the cache."""


@dataclass(frozen=True, eq=False)
class CachedMission:
    """Hold a mission. ``found`` is True if it was in the cache; ``warning`` describes a damaged entry that
    it replaces."""

    mission: Mission
    found: bool
    warning: str | None = None


class MissionCache:
    """Manage a folder of missions for any number of processes at once.

    The first process that needs a mission simulates it, while others that need it wait. Entries appear complete;
    damaged ones are simulated again. Raises ``ValueError`` if the folder is not such a cache, ``OSError`` if it cannot
    be written.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        _claim(folder)

    def mission(self, world: World, settings: MissionSettings, seed: int, clear_range: float = 0.0) -> CachedMission:
        """Return the mission of ``simulate``, from the cache if possible; raises as ``simulate``."""
        key = mission_key(world, settings, seed, clear_range)
        entry = self.folder / f"{re.sub('[^A-Za-z0-9_]', '_', world.name)[:60]}-{seed}-{key[:16]}"
        with FileLock(self.folder / f".{entry.name}.lock"):
            trouble = _trouble(entry) if entry.exists() else None
            if entry.exists() and trouble is None:
                return CachedMission(load_mission(entry), found=True)
            mission, _ = simulate(world, settings, seed, clear_range=clear_range)
            with atomic_folder(entry) as aside:
                save_mission(mission, aside)
                write_bytes_atomically(aside / HASHES_FILE, to_text({"key": key, "files": _hashes(aside)}).encode())
        return CachedMission(mission, found=False, warning=trouble and f"{entry}: {trouble}; simulated again")


def mission_key(world: World, settings: MissionSettings, seed: int, clear_range: float = 0.0) -> str:
    """Hash all inputs of a mission (SHA-256); ``clear_range`` counts only if the mission is cut to an overlap."""
    record = {
        "world": world_to_json(world),
        "settings": dataclasses.asdict(settings),
        "seed": seed,
        "clear_range": clear_range if settings.overlap is not None else None,
        "code": _code(),
    }
    return hashlib.sha256(json.dumps(record, sort_keys=True).encode()).hexdigest()


@cache
def _code() -> str:
    digest = hashlib.sha256(version("pybullet").encode())
    for room in ROOMS:
        digest.update(code_digest(Path(str(resources.files(room)))).encode())
    return digest.hexdigest()


def _claim(folder: Path) -> None:
    if folder.exists() and not folder.is_dir():
        raise ValueError(f"{folder}: exists and is not a folder")
    folder.mkdir(parents=True, exist_ok=True)
    mark = folder / MARK_FILE
    # Looked at before the mark, which another process may write meanwhile; its half is hidden.
    foreign = any(not path.name.startswith(".") for path in folder.iterdir())
    if not mark.exists():
        if foreign and not mark.exists():
            raise ValueError(f"{folder}: is not empty and no cache of missions; refusing to write into it")
        write_bytes_atomically(mark, to_text({"schema": SCHEMA}).encode())
    elif read_json(mark) != {"schema": SCHEMA}:
        raise ValueError(f"{mark}: is not the mark of a {SCHEMA}")


def _trouble(entry: Path) -> str | None:
    try:
        record = read_json(entry / HASHES_FILE)
        found = _hashes(entry)
    except (ValueError, OSError) as error:
        return f"its {HASHES_FILE} cannot be read ({' '.join(str(error).split())[:200]})"
    expected = record.get("files") if isinstance(record, dict) else None
    if not isinstance(expected, dict):
        return f"its {HASHES_FILE} lists no files"
    for name, digest in sorted(expected.items()):
        if digest != found.get(name):
            return f"its {name} has changed"
    return None


def _hashes(entry: Path) -> dict[str, str]:
    files = sorted(path for path in entry.iterdir() if path.is_file() and path.name != HASHES_FILE)
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in files}
