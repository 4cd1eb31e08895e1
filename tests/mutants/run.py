"""Judges mutants, each in a fork of this process: all libraries are imported here once, the program never is."""

import argparse
import importlib
import json
import os
import re
import resource
import signal
import sys
import time
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any

from tests.mutants.suites import LEFT_OUT, SUITES, Tests, suite_of

# what a fork would else import anew for every mutant; jax begins its threads at the first computation, not here
LIBRARIES = ("jax", "jax.numpy", "equinox", "optimistix", "diffrax", "numpy", "scipy.optimize", "scipy.stats",
             "scipy.signal", "scipy.interpolate", "pandas", "pint", "tomlkit", "click.testing", "rich.console",
             "hypothesis", "sympy", "threadpoolctl", "sklearn.linear_model", "pytest", "pytest_benchmark.plugin",
             "pytest_timeout", "xdist", "_pytest.assertion.rewrite")  # fmt: skip
SLOWER = 3.0  # times the CPU time of the tests as they are, which a mutant may take
PATIENCE = 10.0  # times that, on the clock
OPTIONS = ("-p", "no:cacheprovider", "-p", "no:xdist", "-q", "--no-header", "--tb=line", "-rfE", "-x", "-o", "addopts=",
           "-o", "timeout=0", "-m", "not slow", "--benchmark-skip")  # fmt: skip


@dataclass(frozen=True)
class Judged:
    """What came of running tests: the exit status (negative: a signal), CPU seconds, the end of what was printed."""

    status: int
    seconds: float
    said: str

    @property
    def killer(self) -> str:
        """The test that failed first, or how else it ended."""
        found = re.search(r"^(?:FAILED|ERROR) (\S+)", self.said, re.MULTILINE)
        if found:
            return found[1]
        return "took too long" if self.status in (-signal.SIGXCPU, -signal.SIGALRM, -signal.SIGKILL) else "broke"


def main() -> int:
    """Judge what is left of the sample, and write the report."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--sample", type=int)
    parser.add_argument("--seed", type=int)
    parser.add_argument("--most", type=int)
    parser.add_argument("--of", default="")
    parser.add_argument("--place", type=Path)
    asked = parser.parse_args()
    sys.path.append(str(asked.place / "tool"))
    name = f"session-{asked.sample}-{asked.seed}-{asked.of.replace('/', '-')}".removesuffix(".py").rstrip("-")
    session = asked.place / f"{name}.sqlite"
    _begin(session, asked.sample, asked.seed, asked.of)
    _warm()
    for line in _judge(session, asked.place, asked.most):
        print(line, flush=True)
    session.with_suffix(".md").write_text(_report(session), encoding="utf-8")
    print(session.with_suffix(".md"))
    return 0


def _begin(session: Path, sample: int, seed: int, of: str) -> None:
    """A fixed sample of all mutants, the same number of each suite; of some files only where they are named."""
    if session.exists():
        return
    from cosmic_ray.commands.init import init  # pyright: ignore[reportMissingImports]
    from cosmic_ray.work_db import WorkDB, use_db  # pyright: ignore[reportMissingImports]
    from cosmic_ray.work_item import WorkItem  # pyright: ignore[reportMissingImports]

    chosen, random = [], Random(seed)
    suites = {suite: [file for file in suite.files() if str(file).startswith(of)] for suite in SUITES}
    for suite, files in suites.items():
        every = session.with_suffix(f".{suite.name}")
        every.unlink(missing_ok=True)
        with use_db(every, WorkDB.Mode.create) as db:
            init(files, db, {})
            items = sorted(db.work_items, key=_order)
        some = [item for item in items if not any(word in item.mutations[0].operator_name for word in LEFT_OUT)]
        print(f"{suite.name}: {len(some)} mutants of {len(files)} files", flush=True)
        share = sample // sum(map(bool, suites.values()))
        chosen += random.sample(some, min(share, len(some)))
        every.unlink()
    random.shuffle(chosen)
    with use_db(session.with_suffix(".new"), WorkDB.Mode.create) as db:
        db.add_work_items(WorkItem(f"{place:06d}", item.mutations) for place, item in enumerate(chosen))
    session.with_suffix(".new").rename(session)


def _order(item: Any) -> tuple:
    mutation = item.mutations[0]
    return str(mutation.module_path), mutation.operator_name, mutation.occurrence


def _warm() -> None:
    warnings.filterwarnings("ignore", message=".*fork.*")
    for name in LIBRARIES:
        importlib.import_module(name)
    assert not {"mckibben_jax", "fitting"} & set(sys.modules), "the program is here: forks would not see their mutant"


def _judge(session: Path, place: Path, most: int | None) -> Iterator[str]:
    """One line for every mutant that has no result yet."""
    from cosmic_ray.mutating import use_mutation  # pyright: ignore[reportMissingImports]
    from cosmic_ray.plugins import get_operator  # pyright: ignore[reportMissingImports]
    from cosmic_ray.work_db import WorkDB, use_db  # pyright: ignore[reportMissingImports]
    from cosmic_ray.work_item import TestOutcome, WorkerOutcome, WorkResult  # pyright: ignore[reportMissingImports]

    usual: dict[Tests, float] = {}
    with use_db(session, WorkDB.Mode.open) as db:
        for item in list(db.pending_work_items)[:most]:
            mutation, begun = item.mutations[0], time.monotonic()
            path = mutation.module_path
            operator, spent, killer, diff = get_operator(mutation.operator_name)(), 0.0, "", ""
            for tests in suite_of(path).judges(path, mutation.start_pos[0]):
                usual[tests] = usual.get(tests) or _unchanged(tests, place)
                with use_mutation(path, operator, mutation.occurrence) as both:
                    judged, diff = _ran(tests, place / "log", SLOWER * usual[tests] + 20), _diff(*both)
                spent += judged.seconds
                if judged.status:
                    killer = judged.killer
                    break
            outcome = TestOutcome.KILLED if killer else TestOutcome.SURVIVED
            db.set_result(item.job_id, WorkResult(WorkerOutcome.NORMAL, f"{spent:.1f} s\n{killer}", outcome, diff))
            where = f"{path}:{mutation.start_pos[0]} {mutation.operator_name.split('/')[-1]}"
            said = f"killed by {killer}" if killer else "SURVIVED"
            yield f"{where}: {said} ({spent:.1f} s CPU, {time.monotonic() - begun:.0f} s)"


def _unchanged(tests: Tests, place: Path) -> float:
    """CPU seconds of tests with nothing changed; that they pass is known from one call to the next."""
    known = place / "unchanged.json"
    told = json.loads(known.read_text()) if known.exists() else {}
    name = " ".join(tests)
    if name not in told:
        found = _ran(tests, place / "log", 3600)
        if found.status:
            raise SystemExit(f"{name}: fails with nothing changed\n{found.said}")
        told[name] = round(found.seconds, 1)
        known.write_text(json.dumps(told, indent=1))
        print(f"{name}: {found.seconds:.1f} s of CPU time with nothing changed", flush=True)
    return told[name]


def _ran(tests: Tests, log: Path, limit: float) -> Judged:
    """The tests in a fork, which ends when they have taken this much CPU time."""
    child = os.fork()
    if not child:
        _in_fork(tests, log, limit)
    _, status, usage = os.wait4(child, 0)
    said = log.read_text(errors="replace")[-20_000:]
    return Judged(os.waitstatus_to_exitcode(status), usage.ru_utime + usage.ru_stime, said)


def _in_fork(tests: Tests, log: Path, limit: float) -> None:
    """Never returns."""
    status = 99
    try:
        resource.setrlimit(resource.RLIMIT_CPU, (int(limit) + 1, int(limit) + 30))
        signal.alarm(int(PATIENCE * limit))
        out = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(out, 1)
        os.dup2(out, 2)
        import pytest

        status = int(pytest.main([*tests, *OPTIONS]))
    finally:
        sys.stdout.flush()
        os._exit(status)


def _diff(before: str, after: str | None) -> str:
    """The lines that differ."""
    if after is None:
        return ""
    pairs = zip(before.splitlines(), after.splitlines(), strict=False)
    return "\n".join(f"- {a.strip()}\n+ {b.strip()}" for a, b in pairs if a != b)


# ---------------------------------------------------------------------------------------------------------- the report


def _report(session: Path) -> str:
    """How many were killed, and every survivor, to be killed by a test or explained."""
    from cosmic_ray.work_db import WorkDB, use_db  # pyright: ignore[reportMissingImports]

    with use_db(session, WorkDB.Mode.open) as db:
        done = [(item.mutations[0], result) for item, result in db.completed_work_items]
        left = sum(1 for _ in db.pending_work_items)
    lines = [f"{len(done)} mutants judged, {left} to go.", ""]
    lines += ["| suite | mutants | killed | CPU time of one |", "|---|---|---|---|"]
    for suite in SUITES:
        mine = [result for mutation, result in done if suite_of(mutation.module_path) == suite]
        if mine:
            killed = sum(result.is_killed for result in mine)
            seconds = sum(float(result.output.split(" s\n")[0]) for result in mine) / len(mine)
            share = 100 * killed / len(mine)
            lines.append(f"| {suite.name} | {len(mine)} | {killed} ({share:.0f} %) | {seconds:.1f} s |")
    lines += ["", "Survivors:", ""]
    for mutation, result in done:
        if not result.is_killed:
            where = f"{mutation.module_path}:{mutation.start_pos[0]} {mutation.operator_name}"
            lines += [where, "```", result.diff, "```", ""]
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
