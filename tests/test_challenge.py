"""The challenge kit: sealing hides the truth and shows every change, answers are kept, scores say what they mean."""

import json
import sys
from pathlib import Path

import pytest
from scipy.stats import binomtest

from tests.hidden.challenge.__main__ import main
from tests.hidden.challenge.collecting import collect
from tests.hidden.challenge.scoring import Case, Measure, measures, outcome, read_cases
from tests.hidden.challenge.sealing import opened, seal
from tests.hidden.challenge.second_rig import make

NOTHING = {"verdict": "nothing detectable", "explanations": []}


@pytest.fixture
def rig(tmp_path) -> Path:
    """Six recordings and their truth."""
    make(tmp_path / "rig", seed=3)
    return tmp_path


@pytest.fixture
def sealed(rig) -> Path:
    """The same, sealed."""
    seal(rig / "rig/recordings", rig / "rig/truth.json", rig / "give/cases", rig / "kept.json")
    return rig


def answered(folder: Path, answers: dict[str, dict]) -> None:
    """Write answers by case."""
    folder.mkdir()
    for case, answer in answers.items():
        (folder / f"{case}.json").write_text(json.dumps(answer))


def case(effects=(), verdict="missing", named=(), in_library=True) -> Case:
    """A case that was answered."""
    answer = {"verdict": verdict, "explanations": [list(names) for names in named]}
    return Case("case-001", frozenset(effects), in_library, {}, answer)


def test_nothing_that_is_given_away_tells_the_truth(sealed):
    told = "".join(path.read_text() + path.name for path in (sealed / "give").rglob("*") if path.is_file())
    for word in ("linear_spring", "viscous_damping", "teeth", "second rig", "three", "effects"):
        assert word not in told
    assert {path.name for path in (sealed / "give/cases").iterdir()} == {f"case-00{n}" for n in range(1, 7)}


def test_the_kept_truth_is_that_of_each_recording(sealed):
    """Shuffled, but each case with its own truth: its readings are those of the recording that it was."""
    truth = json.loads((sealed / "rig/truth.json").read_text())
    for name, entry in opened(sealed / "kept.json", sealed / "give/cases").items():
        was = sealed / "rig/recordings" / entry["was"]
        assert (sealed / "give/cases" / name / "loops.csv").read_text() == (was / "loops.csv").read_text()
        assert entry["effects"] == truth[entry["was"]]["effects"]


def test_a_changed_truth_or_recording_is_not_scored(sealed, capsys):
    kept, cases = sealed / "kept.json", sealed / "give/cases"
    (sealed / "answers").mkdir()
    score = ["score", str(cases), str(kept), str(sealed / "answers")]
    assert main(score) == 0
    whole = kept.read_text()
    kept.write_text(whole.replace("linear_spring", "hill"))
    assert main(score) == 2
    assert "is not what was sealed" in capsys.readouterr().err
    kept.write_text(whole)
    with (cases / "case-002/loops.csv").open("a") as file:
        file.write("0,99,1,1,1\n")
    assert main(score) == 2
    assert "case-002/loops.csv was changed" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("write", "message"),
    [
        (lambda rig: (rig / "recordings/one/loops.csv").open("a").write("# x\n1,teeth\n"), None),
        (lambda rig: (rig / "recordings/six/loops.csv").open("a").write("1,teeth\n"), "gives the answer away"),
        (lambda rig: (rig / "truth.json").write_text('{"one": {"effects": []}}'), "do not name the same cases"),
        (lambda rig: (rig / "truth.json").write_text("{"), "property name"),
    ],
)
def test_what_cannot_be_sealed_is_refused_and_leaves_nothing(rig, capsys, write, message):
    write(rig / "rig")
    words = ["seal", str(rig / "rig/recordings"), str(rig / "rig/truth.json")]
    status = main([*words, "--cases", str(rig / "give/cases"), "--keep", str(rig / "kept.json")])
    assert status == (2 if message else 0)
    if message:
        assert message in capsys.readouterr().err
        assert not (rig / "give/cases").exists()
        assert not (rig / "kept.json").exists()


PROGRAM = """
import json, pathlib, sys
case, answer = map(pathlib.Path, sys.argv[1:])
(case / "model.toml").write_text("left behind")
if case.name == "case-003":
    sys.exit("case-003 is too hard")
answer.write_text(json.dumps({"verdict": "nothing detectable", "explanations": []}))
"""


def test_answers_are_collected_once_and_failures_are_kept_in_the_log(sealed):
    program = sealed / "program.py"
    program.write_text(PROGRAM)
    command = f"{sys.executable} {program} {{case}} {{answer}}"
    log = collect(command, sealed / "give/cases", sealed / "answers")
    assert sum(one["answered"] for one in log.values()) == 5
    assert "too hard" in log["case-003"]["last"]
    assert opened(sealed / "kept.json", sealed / "give/cases")  # what the program wrote, it wrote into a copy
    program.write_text("raise SystemExit(1)")
    again = collect(command, sealed / "give/cases", sealed / "answers")
    assert sum(one["answered"] for one in again.values()) == 5


def test_a_case_that_takes_too_long_is_stopped_and_is_no_answer(sealed):
    program = sealed / "program.py"
    program.write_text("import sys, time\nopen(sys.argv[2], 'w').write('{')\ntime.sleep(60)")
    for each in ("case-002", "case-003", "case-004", "case-005", "case-006"):
        (sealed / "give/cases" / each / "loops.csv").unlink()
        (sealed / "give/cases" / each / "muscle.toml").unlink()
        (sealed / "give/cases" / each).rmdir()
    log = collect(f"{sys.executable} {program} {{case}} {{answer}}", sealed / "give/cases", sealed / "answers", 1.0)
    assert log["case-001"]["last"] == "stopped after 1 s"
    assert not log["case-001"]["answered"]


@pytest.mark.parametrize(
    ("said", "became"),
    [
        (case(), "false alarm"),
        (case(verdict="not in the library"), "false alarm"),
        (case(verdict="within the instruments"), "silent on a clean case"),
        (case(verdict="inconclusive", named=[("hill",)]), "silent on a clean case"),
        (case(["hill"], named=[("hill",)]), "named exactly"),
        (case(["hill"], named=[("hill", "creep")]), "wrong alone"),
        (case(["hill", "creep"], named=[("creep", "hill")]), "named exactly"),
        (case(["hill", "creep"], named=[("creep",)]), "wrong alone"),
        (case(["hill"], "one of", [("hill",), ("creep",)]), "tied set contains"),
        (case(["hill"], "one of", [("mullins",), ("creep",)]), "tied set without the truth"),
        (case(["hill"], "not in the library"), "not in the library, wrongly"),
        (case(["teeth"], "not in the library", in_library=False), "not in the library, right"),
        (case(["teeth"], named=[("teeth",)], in_library=False), "wrong alone"),
        (case(["hill"], "nothing detectable"), "nothing said"),
    ],
)
def test_the_outcome_of_a_case(said, became):
    assert outcome(said) == became


@pytest.mark.parametrize(
    "text",
    ["", "[]", "{}", '{"verdict": "perhaps"}', '{"verdict": "missing"}', '{"verdict": "one of", "explanations": [7]}'],
)
def test_an_answer_out_of_the_format_counts_against_the_program(tmp_path, text):
    (tmp_path / "case-001.json").write_text(text)
    (one,) = read_cases({"case-001": {"effects": ["hill"]}}, tmp_path)
    assert outcome(one) == "no answer"
    rows = {row.name: (row.count, row.cases) for row in measures([one])}
    assert rows["named exactly"] == (0, 1)
    assert rows["no valid answer"] == (1, 1)


def test_estimates_are_held_against_the_true_sizes(tmp_path):
    truth = {"case-001": {"effects": ["linear_spring"], "sizes": {"linear_spring.K": 600.0}}}

    def covered(value: float, error: float) -> tuple[int, int]:
        answer = {"verdict": "missing", "explanations": [["linear_spring"]]}
        answer["effects"] = {"linear_spring": {"estimate": {"K": [value, error]}}}
        (tmp_path / "case-001.json").write_text(json.dumps(answer))
        row = measures(read_cases(truth, tmp_path))[-1]
        return row.count, row.cases

    assert covered(619.0, 10.0) == (1, 1)
    assert covered(621.0, 10.0) == (0, 1)
    assert covered(float("nan"), 10.0) == (0, 0)


@pytest.mark.parametrize(("count", "cases"), [(0, 6), (3, 7), (40, 40)])
def test_intervals_are_those_of_wilson(count, cases):
    expected = binomtest(count, cases).proportion_ci(0.95, "wilson")
    assert Measure("", count, cases).interval == pytest.approx((expected.low, expected.high), abs=1e-12)
    assert Measure("", 0, 0).interval == (0.0, 1.0)
