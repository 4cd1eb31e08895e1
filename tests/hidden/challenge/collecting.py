"""Run a program on every sealed case and gather its answers."""

from __future__ import annotations

import json
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

TAIL = 500  # characters of the program's last words that the log keeps: enough for one message


def filled(template: str, case: Path, answer: Path) -> list[str]:
    """The command of one case: words of the template with {case} and {answer} put in."""
    if "{case}" not in template or "{answer}" not in template:
        raise ValueError("The command must contain {case} (a folder) and {answer} (the JSON file to write).")
    return [word.replace("{case}", str(case)).replace("{answer}", str(answer)) for word in shlex.split(template)]


def run_one(template: str, case: Path, answer: Path, limit: float) -> dict:
    """Run the program on a copy of the case, so that what it writes there changes nothing; returns its log."""
    with tempfile.TemporaryDirectory() as place:
        copy = Path(shutil.copytree(case, Path(place) / case.name))
        began = time.perf_counter()
        try:
            done = subprocess.run(
                filled(template, copy, answer), capture_output=True, text=True, timeout=limit, check=False
            )
            status, last = done.returncode, done.stderr[-TAIL:]
        except subprocess.TimeoutExpired:
            status, last = None, f"stopped after {limit:g} s"
            answer.unlink(missing_ok=True)  # half an answer is none
    seconds = round(time.perf_counter() - began, 2)
    return {"status": status, "seconds": seconds, "answered": answer.exists(), "last": last}


def collect(template: str, cases: Path, answers: Path, limit: float = 3600.0) -> dict[str, dict]:
    """Write one answer a case, CASE.json, and log.json: exit status, wall time in s, the program's last words.

    An answer that is there already is kept, so that a stopped collection goes on where it stood.
    """
    answers.mkdir(parents=True, exist_ok=True)
    log_file = answers / "log.json"
    log = json.loads(log_file.read_text()) if log_file.exists() else {}
    for case in sorted(path for path in cases.iterdir() if path.is_dir()):
        answer = answers.resolve() / f"{case.name}.json"
        if case.name in log and answer.exists():
            continue
        answer.unlink(missing_ok=True)
        log[case.name] = run_one(template, case, answer, limit)
        log_file.write_text(json.dumps(log, indent=1))
        print(f"{case.name}: exit status {log[case.name]['status']}", file=sys.stderr)
    return log
