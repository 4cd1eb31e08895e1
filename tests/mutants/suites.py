"""What is mutated, and by which tests each mutant is judged: the cheap ones first, the rest only for what survives."""

import ast
import re
from dataclasses import dataclass
from pathlib import Path

Tests = tuple[str, ...]  # what pytest is called with
# on floating-point numbers these are errors of type that the first call finds: they would only flatter the score
LEFT_OUT = ("RShift", "LShift", "BitOr", "BitAnd", "BitXor")
LIBRARY = "mckibben_jax/effects"


@dataclass(frozen=True, eq=False)
class Suite:
    """Files, or all files of folders, that a sample is drawn from; and for each the tests, in stages.

    The stages are those of the first name in `stages` that the file's path begins with.
    """

    name: str
    modules: tuple[str, ...]
    stages: dict[str, tuple[Tests, ...]]

    def files(self) -> list[Path]:
        """The modules, file by file; FileNotFoundError where one has moved away."""
        places = [Path(name) for name in self.modules]
        for place in places:
            if not place.exists():
                raise FileNotFoundError(f"{place}, which stands in {__name__}, is not there any more")
        return sorted(file for place in places for file in ([place] if place.is_file() else place.rglob("*.py")))

    def judges(self, path: Path, row: int) -> tuple[Tests, ...]:
        """The tests for a mutant in this line; those of one effect where it lies in the class of one."""
        name = next(name for name in self.stages if str(path).startswith(name))
        effect = _effect_at(path, row) if name == LIBRARY else ""  # supplies are not in the library
        stages = self.stages[name]
        return (("tests/test_effects.py", "-k", effect), *stages) if effect else stages


PHYSICS = Suite(
    "physics",
    (
        LIBRARY, "mckibben_jax/effect.py", "mckibben_jax/model.py", "mckibben_jax/memory.py",
        "mckibben_jax/motion/friction_step.py", "mckibben_jax/laws/braid.py", "mckibben_jax/laws/rubber.py",
        "mckibben_jax/laws/textile.py", "mckibben_jax/laws/biology.py",
    ),
    {
        "mckibben_jax/effects/supply.py": (
            ("tests/test_public_api.py",),
            ("tests/test_supply.py", "tests/test_memory.py"),
        ),
        LIBRARY: (("tests/test_public_api.py",), ("tests/test_memory.py", "tests/test_model.py")),
        "mckibben_jax/effect.py": (("tests/test_model.py",), ("tests/test_effects.py",)),
        "mckibben_jax/model.py": (("tests/test_model.py",), ("tests/test_effects.py",), ("tests/test_motion.py",)),
        "mckibben_jax/memory.py": (("tests/test_memory.py",), ("tests/test_effects.py",)),
        "mckibben_jax/motion/friction_step.py": (("tests/test_motion.py",),),
        "mckibben_jax": (("tests/test_golden.py",), ("tests/test_equations.py",), ("tests/test_derivatives.py",)),
    },
)  # fmt: skip
DIAGNOSIS = Suite(
    "diagnosis",
    (
        "fitting/diagnosis",
        "fitting/comparison/fingerprint.py",
        "fitting/comparison/parity.py",
        "fitting/least_squares/held_out.py",
        "fitting/least_squares/refits.py",
        "fitting/least_squares/working_noise.py",
    ),
    {
        "fitting/diagnosis/proposal": (("tests/test_proposal.py",),),
        "fitting/diagnosis/detection": (("tests/test_detection.py",), ("tests/test_diagnose.py",)),
        "fitting/diagnosis/projected": (("tests/test_projected.py",), ("tests/test_flips.py",)),
        "fitting/comparison/fingerprint": (("tests/test_fingerprint.py",), ("tests/test_compare.py",)),
        "fitting/comparison/parity": (("tests/test_omnibus.py",), ("tests/test_compare.py",)),
        "fitting/diagnosis/omnibus": (
            ("tests/test_omnibus.py",),
            ("tests/test_flips.py",),
            ("tests/test_diagnose.py",),
        ),
        "fitting/least_squares/refits": (("tests/test_searches.py",),),
        "fitting/least_squares/held_out": (("tests/test_verdict.py",), ("tests/test_flips.py",)),
        **dict.fromkeys(
            ("fitting/diagnosis/search", "fitting/diagnosis/search_result", "fitting/diagnosis/linear_look"),
            (("tests/test_search.py",), ("tests/test_larger_sets.py",), ("tests/test_diagnose.py",)),
        ),
        **dict.fromkeys(
            ("fitting/diagnosis/adequacy", "fitting/diagnosis/record"),
            (("tests/test_adequacy.py",), ("tests/test_diagnose.py",)),
        ),
        "fitting/diagnosis/examine": (
            ("tests/test_adequacy.py",),
            ("tests/test_equivalent.py",),
            ("tests/test_search.py",),
            ("tests/test_diagnose.py",),
        ),
        "fitting/diagnosis/equivalent": (("tests/test_equivalent.py",), ("tests/test_search.py",)),
        "fitting/diagnosis/likelihood": (("tests/test_likelihood.py",), ("tests/test_search.py",)),
        "fitting/diagnosis/blamed": (("tests/test_blamed.py",),),
        **dict.fromkeys(
            ("fitting/diagnosis/universe", "fitting/diagnosis/signatures"),
            (("tests/test_universe.py",), ("tests/test_search.py",)),
        ),
        **dict.fromkeys(
            ("fitting/diagnosis/flip_groups", "fitting/diagnosis/sign_flips", "fitting/diagnosis/missing_effect"),
            (("tests/test_verdict.py",), ("tests/test_flips.py",), ("tests/test_diagnose.py",)),
        ),
        "fitting/least_squares/working_noise": (
            ("tests/test_verdict.py", "tests/test_instrument_errors.py"),
            ("tests/test_flips.py",),
            ("tests/test_static_maps.py",),
        ),
        "fitting/diagnosis/similarity": (("tests/test_similarity.py",), ("tests/test_diagnose.py",)),
        "fitting/diagnosis/substitutes": (("tests/test_substitutes.py",), ("tests/test_diagnose.py",)),
        "fitting/diagnosis/odd_runs": (("tests/test_odd_runs.py",),),
        "fitting/diagnosis/larger_sets": (("tests/test_larger_sets.py",),),
        **dict.fromkeys(("fitting/diagnosis/dropping", "fitting/diagnosis/course"), (("tests/test_dropping.py",),)),
        **dict.fromkeys(
            (
                "fitting/diagnosis/discover",
                "fitting/diagnosis/next_model",
                "fitting/diagnosis/tiers",
                "fitting/diagnosis/step_rules",
                "fitting/diagnosis/findings",
            ),
            (("tests/test_discover.py",), ("tests/test_practice.py", "tests/test_path.py")),
        ),
        "fitting/diagnosis/among_all": (("tests/test_searches.py",), ("tests/test_discover.py",)),
        **dict.fromkeys(
            ("fitting/diagnosis/candidate_fit", "fitting/diagnosis/instrument_answers", "fitting/diagnosis/nuisance"),
            (("tests/test_instrument_errors.py", "tests/test_projected.py"), ("tests/test_diagnose.py",)),
        ),
        "fitting/diagnosis": (("tests/test_flips.py",), ("tests/test_diagnose.py",)),
    },
)
INSTRUMENTS = Suite(
    "instruments",
    (
        "fitting/instruments",
        "fitting/recordings/accuracy.py", "fitting/recordings/accuracy_table.py",
        "fitting/recordings/channel_errors.py", "fitting/recordings/contrasts.py",
        "fitting/recordings/input_errors.py", "fitting/recordings/inputs.py",
        "fitting/recordings/noise.py", "fitting/recordings/presumed.py", "fitting/recordings/smoother.py",
    ),
    {
        "fitting/recordings/contrasts": (("tests/test_contrasts.py",), ("tests/test_estimated_inputs.py",)),
        "fitting/recordings": (
            ("tests/test_accuracy.py", "tests/test_channel_errors.py"),
            ("tests/test_estimated_inputs.py",),
        ),
        "fitting/instruments": (
            ("tests/test_errors_felt.py", "tests/test_instrument_errors.py"),
            ("tests/test_through.py",),
            ("tests/test_errors_of_values.py",),
        ),
    },
)  # fmt: skip
READERS = (("tests/test_recordings.py", "tests/test_tables.py", "tests/test_refusals.py"),)
RECORDINGS = Suite(
    "recordings",
    (
        "fitting/recordings/bag.py", "fitting/recordings/checks.py", "fitting/recordings/experiment.py",
        "fitting/recordings/inverse_dynamics.py", "fitting/recordings/mat_elements.py",
        "fitting/recordings/mat_file.py",
        "fitting/recordings/mat_hdf5.py", "fitting/recordings/mat_variables.py", "fitting/recordings/motion_signals.py",
        "fitting/recordings/muscle_file.py", "fitting/recordings/plausible.py", "fitting/recordings/readings.py",
        "fitting/recordings/records.py", "fitting/recordings/runs.py", "fitting/recordings/spikes.py",
        "fitting/recordings/table_cells.py", "fitting/recordings/table_text.py", "fitting/recordings/tables.py",
        "fitting/recordings/tdms_file.py", "fitting/recordings/template.py", "fitting/recordings/weightless.py",
        "fitting/recordings/workbook.py", "fitting/units.py",
    ),
    {
        "fitting/recordings/bag": (("tests/test_bags.py",),),
        "fitting/recordings/inverse_dynamics": (("tests/test_inverse_dynamics.py",),),
        "fitting/recordings/mat": (("tests/test_mat_files.py",),),
        **dict.fromkeys(
            ("fitting/recordings/motion_signals", "fitting/recordings/weightless"),
            (("tests/test_signals.py",), ("tests/test_recordings.py",), ("tests/test_inverse_dynamics.py",)),
        ),
        "fitting/recordings/spikes": (("tests/test_spikes.py",),),
        "fitting/recordings/tdms": (("tests/test_tdms_files.py",),),
        "fitting/recordings/template": (("tests/test_init.py",), ("tests/test_sizes.py",)),
        "fitting/recordings/workbook": (("tests/test_workbooks.py",),),
        "fitting/units": (*READERS, ("tests/test_sizes.py", "tests/test_own_units.py")),
        "fitting/recordings": (*READERS, ("tests/test_signals.py", "tests/test_sizes.py"), ("tests/fuzz",)),
    },
)  # fmt: skip
SUITES = (PHYSICS, DIAGNOSIS, INSTRUMENTS, RECORDINGS)


def suite_of(path: Path) -> Suite:
    """The suite that a file belongs to."""
    return next(suite for suite in SUITES if path in suite.files())


def _effect_at(path: Path, row: int) -> str:
    """The name of the effect whose class holds this line; empty outside of classes and in those that are no effect."""
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.ClassDef) and node.lineno <= row <= (node.end_lineno or 0):
            return "" if node.name.startswith("_") else re.sub(r"(?<!^)(?=[A-Z])", "_", node.name).lower()
    return ""
