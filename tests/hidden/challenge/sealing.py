"""Sealed cases: anonymous folders, the truth apart, and a salted hash that commits the sealer to both."""

from __future__ import annotations

import hashlib
import json
import re
import secrets
import shutil
import tomllib
from pathlib import Path

TITLE = re.compile(r"^name\s*=.*$", re.MULTILINE)


def canonical(record: dict) -> bytes:
    """The record as bytes that do not depend on the order of its keys."""
    return json.dumps(record, sort_keys=True, separators=(",", ":"), allow_nan=False).encode()


def digest(path: Path) -> str:
    """SHA-256 of one file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def file_hashes(cases: Path) -> dict[str, str]:
    """SHA-256 of every file of every case, by its path inside the folder of cases."""
    return {path.relative_to(cases).as_posix(): digest(path) for path in sorted(cases.rglob("*")) if path.is_file()}


def commitment(kept: dict) -> str:
    """What is published: SHA-256 of salt, truth and the hashes of all files, together."""
    return hashlib.sha256(canonical(kept)).hexdigest()


def without_comments(text: str) -> str:
    """The text without lines that begin with #."""
    return "".join(line for line in text.splitlines(keepends=True) if not line.lstrip().startswith("#"))


def checked_truth(truth: dict, source: Path) -> dict:
    """The truth file, where it has one sound entry for every folder of recordings and for nothing else."""
    folders = {path.parent.name for path in source.glob("*/muscle.toml")}
    if not folders:
        raise ValueError(f"{source}: no folder in it has a muscle.toml.")
    if folders != set(truth):
        odd = ", ".join(sorted(folders ^ set(truth)))
        raise ValueError(f"Recordings and truth file do not name the same cases: {odd} stands in one of them only.")
    for name, entry in truth.items():
        if not isinstance(entry, dict) or not isinstance(entry.get("effects"), list):
            raise ValueError(f'{name}: the truth of a case needs "effects", a list of names (empty for a clean case).')
        if unknown := set(entry) - {"effects", "in_library", "sizes"}:
            raise ValueError(f'{name}: unknown key {sorted(unknown)}; use "effects", "in_library" and "sizes".')
    return truth


def sealed_muscle_file(text: str, name: str) -> str:
    """muscle.toml under the anonymous name, without lines of comment."""
    text = TITLE.sub("", without_comments(text), count=1) if "name" in tomllib.loads(text) else without_comments(text)
    return f'name = "{name}"\n{text}'


def copy_case(source: Path, target: Path, effects: list[str]) -> None:
    """Copy muscle.toml and the recordings that it names, and nothing else; refuse where a text names the answer."""
    text = (source / "muscle.toml").read_text()
    texts = {"muscle.toml": sealed_muscle_file(text, target.name)}
    for recording in tomllib.loads(text).get("recording", []):
        texts[recording["file"]] = without_comments((source / recording["file"]).read_text())
    for name, content in texts.items():
        if Path(name).name != name:
            raise ValueError(f"{source / 'muscle.toml'}: recording {name} must lie in the folder itself.")
        if given_away := [effect for effect in effects if effect in content or effect in name]:
            raise ValueError(f"{source / name} gives the answer away: it contains {given_away[0]!r}.")
    target.mkdir(parents=True)
    for name, content in texts.items():
        (target / name).write_text(content)


def seal(source: Path, truth_file: Path, cases: Path, kept_file: Path) -> str:
    """Write the sealed `cases` with commitment.json beside them, and the kept truth. Returns the commitment.

    `source`: one folder a case, each with muscle.toml and CSV files. `truth_file`: JSON, by folder name. Nothing that
    is there already is overwritten, and nothing is left behind where a case is refused.
    """
    published = cases.parent / "commitment.json"
    for path in (cases, kept_file, published):
        if path.exists():
            raise ValueError(f"{path} exists already; choose another place.")
    if cases.resolve() in kept_file.resolve().parents:
        raise ValueError("The kept truth must not lie among the cases.")
    truth = checked_truth(json.loads(truth_file.read_text()), source)
    order = sorted(truth)
    secrets.SystemRandom().shuffle(order)
    anonymous = {old: f"case-{number:03d}" for number, old in enumerate(order, start=1)}
    try:
        for old, new in anonymous.items():
            copy_case(source / old, cases / new, truth[old]["effects"])
    except (ValueError, OSError):
        shutil.rmtree(cases, ignore_errors=True)
        raise
    kept = {
        "salt": secrets.token_hex(32),
        "files": file_hashes(cases),
        "truth": {new: {**truth[old], "was": old} for old, new in anonymous.items()},
    }
    kept_file.parent.mkdir(parents=True, exist_ok=True)
    kept_file.write_text(json.dumps(kept, indent=1))
    published.write_text(json.dumps({"sha256": commitment(kept), "cases": len(order)}, indent=1) + "\n")
    return commitment(kept)


def opened(kept_file: Path, cases: Path) -> dict[str, dict]:
    """The truth by case, where neither it nor any file of a case was changed after sealing; ValueError otherwise."""
    kept = json.loads(kept_file.read_text())
    promised = json.loads((cases.parent / "commitment.json").read_text())["sha256"]
    if commitment(kept) != promised:
        raise ValueError(f"{kept_file} is not what was sealed: its hash differs from the published commitment.")
    now = file_hashes(cases)
    if changed := sorted(
        name for name in kept["files"].keys() | now.keys() if kept["files"].get(name) != now.get(name)
    ):
        raise ValueError(f"{changed[0]} was changed, added or removed after sealing.")
    return kept["truth"]
