"""Plans that a data set carries inside, as world files, so that its samples can be made again anywhere."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from mapquilt.dataset.spec import DatasetSpec, MissionsSpec
from mapquilt.json_file import record_bytes
from mapquilt.runs.open_world import is_world_file, open_world
from worlds.world import World
from worlds.world_file import world_to_json

PLANS_FOLDER = "plans"


@dataclass(frozen=True)
class CarriedPlans:
    """Hold a specification whose worlds from files are named by their place in the data set, the content of these
    files and the worlds by path, notes of their readers, and a record of each for the manifest."""

    spec: DatasetSpec
    files: Mapping[str, bytes]
    worlds: Mapping[str, World]
    notes: tuple[str, ...] = ()
    records: tuple[dict[str, str], ...] = ()


def carry_plans(spec: DatasetSpec, base: Path = Path()) -> CarriedPlans:
    """Read the plan of each group of missions as a world file that the data set carries.

    ``base`` is the folder of the specification, in which plans lie that are carried already. Raises ``ValueError`` or
    ``OSError`` with the plan if it cannot be opened, robots cannot explore it, a picture has no ``plan_resolution``, or
    a carried one has changed.
    """
    groups: list[MissionsSpec] = []
    files: dict[str, bytes] = {}
    worlds: dict[str, World] = {}
    notes: list[str] = []
    records: dict[str, dict[str, str]] = {}
    for group in spec.missions:
        if not is_world_file(group.world):
            groups.append(group)
            continue
        source = base / group.world if group.plan_sha256 else Path(group.world)
        world, found = open_world(str(source), 0, group.width, group.height, group.plan)
        content = record_bytes(source, "world", world_to_json(world))
        digest = hashlib.sha256(content).hexdigest()
        if group.plan_sha256 not in (None, digest):
            raise ValueError(f"{source}: has changed; its SHA-256 must be {group.plan_sha256}")
        path = _free_path(files, world.name, content)
        files[path], worlds[path] = content, world
        notes += found
        records[path] = {"kind": "plan", "file": path, "name": source.name, "licence": group.licence, "sha256": digest}
        changes = {"world": path, "plan_sha256": digest, "plan_resolution": None, "level": None, "from_map": False}
        groups.append(group.model_copy(update=changes))
    carried = spec.model_copy(update={"missions": tuple(groups)})
    return CarriedPlans(carried, files, worlds, tuple(dict.fromkeys(notes)), tuple(records.values()))


def _free_path(files: Mapping[str, bytes], name: str, content: bytes) -> str:
    """Return the path of a plan; plans of the same name and another content are numbered."""
    stem = "".join(letter if letter.isalnum() or letter in "-_." else "_" for letter in name)
    for number in range(len(files) + 1):
        path = f"{PLANS_FOLDER}/{stem}{f'_{number + 1}' if number else ''}.json"
        if files.get(path, content) == content:
            return path
    raise AssertionError("one of n + 1 names is free among n files")
