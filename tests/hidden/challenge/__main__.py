"""python -m tests.hidden.challenge seal, collect or score; `--help` after each says what it needs."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from .collecting import collect
from .scoring import read_cases, score_record, table
from .sealing import opened, seal


def parser() -> argparse.ArgumentParser:
    """Three commands."""
    whole = argparse.ArgumentParser(prog="python -m tests.hidden.challenge")
    commands = whole.add_subparsers(dest="command", required=True)
    one = commands.add_parser("seal", help="make sealed cases from recordings and a truth file")
    one.add_argument("recordings", type=Path, help="folder with one folder a case, each with a muscle.toml")
    one.add_argument("truth", type=Path, help="JSON: what is hidden, by folder name")
    one.add_argument("--cases", type=Path, required=True, help="new folder for the sealed cases, to give away")
    one.add_argument("--keep", type=Path, required=True, help="new file for salt and truth, to keep until scoring")
    two = commands.add_parser("collect", help="run a program on every case")
    two.add_argument("cases", type=Path)
    two.add_argument("--command", dest="template", required=True, help="with {case} and {answer}")
    two.add_argument("--answers", type=Path, required=True, help="folder for the answers")
    two.add_argument("--limit", type=float, default=3600.0, help="seconds for one case (default 3600)")
    three = commands.add_parser("score", help="score the answers")
    three.add_argument("cases", type=Path)
    three.add_argument("kept", type=Path, help="the file that seal wrote with --keep")
    three.add_argument("answers", type=Path)
    three.add_argument("--json", type=Path, help="write the scores here too")
    return whole


def run(options: argparse.Namespace) -> None:
    """Do what was asked."""
    if options.command == "seal":
        print(f"commitment {seal(options.recordings, options.truth, options.cases, options.keep)}")
    elif options.command == "collect":
        log = collect(options.template, options.cases, options.answers, options.limit)
        print(f"{sum(one['answered'] for one in log.values())} of {len(log)} cases answered")
    else:
        cases = read_cases(opened(options.kept, options.cases), options.answers)
        print(table(cases))
        if options.json:
            options.json.write_text(json.dumps(score_record(cases), indent=1) + "\n")


def main(words: list[str] | None = None) -> int:
    """Exit status 0, or 2 with one message where the input is at fault."""
    try:
        run(parser().parse_args(words))
    except (ValueError, OSError, KeyError) as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
