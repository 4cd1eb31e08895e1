"""`python -m tests.fuzz.guided READER -runs=100000 -seed=1`: a coverage-guided fuzzer looks for new ways through.

It needs atheris (`pip install atheris`, Linux), which is no dependency of the project. What follows the reader's name
goes to libFuzzer. The corpus begins with the good inputs; half of the time they are damaged as in `mutations.py`,
else as libFuzzer does it.
"""

import sys
import tempfile
from pathlib import Path
from random import Random

import atheris  # pyright: ignore[reportMissingImports]

with atheris.instrument_imports(include=["fitting", "tomllib"]):
    from tests.fuzz.readers import READERS, refusal
from tests.fuzz.mutations import damaged


def main() -> None:
    """Fuzz one reader; whatever is no refusal stops the run with its traceback and leaves its input in a file."""
    reader = READERS[sys.argv[1]]
    corpus = Path(tempfile.mkdtemp(prefix="mckibben_corpus_"))
    for number, good in enumerate(reader.good):
        (corpus / str(number)).write_bytes(good)

    def mutate(data: bytes, max_size: int, seed: int) -> bytes:
        random = Random(seed)
        if random.random() < 0.5:
            return atheris.Mutate(data, len(data))[:max_size]
        return damaged(data, random)[:max_size]

    libfuzzer = [sys.argv[0], "-timeout=10", "-rss_limit_mb=2048", "-max_len=20000", *sys.argv[2:], str(corpus)]
    atheris.Setup(libfuzzer, lambda data: refusal(reader, data), custom_mutator=lambda *given: mutate(*given))
    atheris.Fuzz()


if __name__ == "__main__":
    main()
