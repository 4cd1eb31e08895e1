"""`python -m tests.mutants --sample 300 --seed 1`: a frozen copy of the tree, and in it the mutants of a fixed sample.

Stopped or killed, the same command goes on. Everything lies in build/mutants: the copy, cosmic-ray (no dependency of
the project; it is installed there), the session, the log of the last mutant, and the report (session-*.md).
"""

import argparse
import compileall
import os
import shutil
import subprocess
import sys
import tarfile
from pathlib import Path
from py_compile import PycInvalidationMode

TOOL = "cosmic-ray==8.7.0"
ROOT = Path(__file__).parents[2]


def main() -> int:
    """Prepare the copy and the tool, then run in the copy."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sample", type=int, default=300, help="mutants in all, the same number of each suite")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--most", type=int, default=None, help="mutants that this call judges; the next goes on")
    parser.add_argument("--of", default="", metavar="PATH", help="only mutants of this file or folder")
    parser.add_argument("--again", action="store_true", help="begin anew, with the tree as it is now")
    parser.add_argument("--place", type=Path, default=ROOT / "build" / "mutants")
    asked = parser.parse_args()
    place = asked.place.resolve()
    if asked.again:
        shutil.rmtree(place, ignore_errors=True)
    _frozen(place)
    _installed(place / "tool")
    given = {"--sample": asked.sample, "--seed": asked.seed, "--of": asked.of, "--place": place} | (
        {} if asked.most is None else {"--most": asked.most}
    )
    command = [sys.executable, "-m", "tests.mutants.run", *(str(word) for pair in given.items() for word in pair)]
    return subprocess.run(command, cwd=place / "source", env=_environment(place)).returncode


def _frozen(place: Path) -> None:
    """The tree as it was at the first call; what a kill left mutated is put back."""
    packed, source = place / "source.tar", place / "source"
    if not packed.exists():
        place.mkdir(parents=True, exist_ok=True)
        listed = subprocess.run(
            ["git", "ls-files", "-co", "--exclude-standard", "-z"], cwd=ROOT, capture_output=True, check=True
        )
        with tarfile.open(place / "source.new", "w") as tar:
            for name in listed.stdout.decode().split("\0"):
                if name and (ROOT / name).is_file():
                    tar.add(ROOT / name, name)
        (place / "source.new").replace(packed)
    with tarfile.open(packed) as tar:
        tar.extractall(source, filter="data")
    compileall.compile_dir(source, quiet=2, invalidation_mode=PycInvalidationMode.CHECKED_HASH)


def _installed(tool: Path) -> None:
    if not (tool / "cosmic_ray").is_dir():
        subprocess.run([sys.executable, "-m", "pip", "install", "--quiet", "--target", str(tool), TOOL], check=True)


def _environment(place: Path) -> dict[str, str]:
    """One thread; compiled programs are kept, for a mutant changes few of them; no compiled Python is written."""
    return os.environ | {
        "PYTHONPATH": str(place / "source"),
        "PYTHONDONTWRITEBYTECODE": "1",
        "OMP_NUM_THREADS": "1",
        "OPENBLAS_NUM_THREADS": "1",
        "JAX_COMPILATION_CACHE_DIR": str(place / "compiled"),
        "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0",
        "JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES": "-1",
    }


if __name__ == "__main__":
    sys.exit(main())
