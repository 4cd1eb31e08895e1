"""`python -m tests.fuzz.run READER... --inputs 100000 --seed 1`: a long run; one line for the table in README.md.

Every input that ends in anything but a result or a refusal in words is kept in build/fuzz, with its traceback.
"""

import argparse
import datetime
import random
import resource
import signal
import sys
import time
import traceback
import warnings
from collections import Counter
from pathlib import Path
from types import FrameType

from tests.fuzz.mutations import damaged
from tests.fuzz.readers import READERS, Reader, refusal

SLOWEST = 10  # seconds of CPU time that one input may take
LONGEST = 120  # seconds on the clock: what waits for ever takes no CPU time
MEMORY = 2 << 30  # bytes that the process may have in use at its peak


class Hang(Exception):
    """One input took too long."""


def main() -> int:
    """Run, print, and say by the exit status whether anything was found."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("readers", nargs="*", default=list(READERS), metavar="READER", help=", ".join(READERS))
    parser.add_argument("--inputs", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=Path, default=Path("build/fuzz"))
    asked = parser.parse_args()
    for number in (signal.SIGPROF, signal.SIGALRM):
        signal.signal(number, _alarm)
    found = 0
    print("| reader | inputs | read | refused | found | slowest input | peak memory | seed | date |")
    for name in asked.readers:
        found += _run(READERS[name], asked.inputs, asked.seed, asked.keep)
    return int(found > 0)


def _alarm(signum: int, frame: FrameType | None) -> None:
    raise Hang(f"more than {SLOWEST} s of CPU time" if signum == signal.SIGPROF else f"more than {LONGEST} s")


def _run(reader: Reader, inputs: int, seed: int, keep: Path) -> int:
    source, counts, kinds, slowest = random.Random(f"{reader.name} {seed}"), Counter(), Counter(), 0.0
    for _ in range(inputs):
        content = damaged(source.choice(reader.good), source, reader.tree)
        begun = time.process_time()
        signal.setitimer(signal.ITIMER_PROF, SLOWEST)
        signal.alarm(LONGEST)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                refused = refusal(reader, content)
            counts["read" if refused is None else "refused"] += 1
        except Exception as error:
            counts["found"] += 1
            _keep(reader, error, content, keep, kinds)
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0)
            signal.alarm(0)
        slowest = max(slowest, time.process_time() - begun)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    if peak > MEMORY:
        counts["found"] += 1
        print(f"{reader.name}: {peak / 2**30:.1f} GiB of memory", file=sys.stderr)
    date = datetime.date.today().isoformat()
    print(f"| {reader.name} | {inputs} | {counts['read']} | {counts['refused']} | {counts['found']} | {slowest:.2f} s "
          f"| {peak / 2**20:.0f} MiB | {seed} | {date} |", flush=True)  # fmt: skip
    return counts["found"]


def _keep(reader: Reader, error: Exception, content: bytes, keep: Path, kinds: Counter[str]) -> None:
    """One input of each kind: a kind is the error and the line of code that raised it."""
    here = traceback.extract_tb(error.__traceback__)[-1]
    kind = f"{type(error).__name__} {Path(here.filename).name} {here.lineno}"
    kinds[kind] += 1
    if kinds[kind] == 1:
        keep.mkdir(parents=True, exist_ok=True)
        path = keep / f"{reader.name} {kind}.txt".replace(" ", "_")
        path.write_bytes(content)
        path.with_suffix(".trace").write_text("".join(traceback.format_exception(error)))
        print(f"{reader.name}: {kind}: {error!s:.200} -> {path}", file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
