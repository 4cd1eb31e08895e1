"""Read recordings, fit and compare, find what is missing from the model, plan the next recording, use what was fitted.

    from fitting import baseline, diagnose, example_data, fit, read_experiment, use_64_bit

    use_64_bit()
    muscle = read_experiment(example_data("muscle_a"))
    print(fit([muscle], baseline()).rmse, diagnose([muscle], baseline()).verdict)

Pictures and sentences are in `fitting.report`, muscles and effects in `mckibben_jax`.
"""

from typing import TYPE_CHECKING

from fitting.lazy import lazily

if TYPE_CHECKING:
    from fitting.comparison.compare import Comparison as Comparison
    from fitting.comparison.compare import compare as compare
    from fitting.compiled.prepare import use_64_bit as use_64_bit
    from fitting.diagnosis.diagnose import diagnose as diagnose
    from fitting.diagnosis.discover import discover as discover
    from fitting.diagnosis.record import Diagnosis as Diagnosis
    from fitting.errors import InputError as InputError
    from fitting.exporting.export import export as export
    from fitting.hill.hill import curves as hill_curves  # noqa: F401
    from fitting.hill.hill import releases as quick_releases  # noqa: F401
    from fitting.least_squares.evaluate import evaluate as evaluate
    from fitting.least_squares.fit import fit as fit
    from fitting.least_squares.record import Fit as Fit
    from fitting.library.library import effects_named as effects_named
    from fitting.library.line import effect_from_line as effect_from_line
    from fitting.model_files.model_file import read_model as read_model
    from fitting.model_files.writer import write_model as write_model
    from fitting.posterior.quick import quick_look as quick_look
    from fitting.posterior.record import Posterior as Posterior
    from fitting.posterior.sample import sample as sample
    from fitting.recordings.experiment import read_experiment as read_experiment
    from fitting.recordings.experiment import read_recording as read_recording
    from fitting.recordings.records import Experiment as Experiment
    from fitting.recordings.template import write_muscle_file as write_muscle_file
    from fitting.shipped import example_data as example_data
    from fitting.shipped import example_names as example_names
    from fitting.shipped import sealed_truth as sealed_truth
    from fitting.study.baseline import baseline as baseline
    from fitting.study.plan import plan as plan
    from fitting.study.simulate import simulate as simulate
    from fitting.study.stages import Stage as Stage
else:
    __getattr__, __dir__ = lazily(
        __name__,
        {
            "Comparison": "comparison.compare",
            "Diagnosis": "diagnosis.record",
            "Experiment": "recordings.records",
            "Fit": "least_squares.record",
            "InputError": "errors",
            "Posterior": "posterior.record",
            "Stage": "study.stages",
            "baseline": "study.baseline",
            "compare": "comparison.compare",
            "diagnose": "diagnosis.diagnose",
            "discover": "diagnosis.discover",
            "effect_from_line": "library.line",
            "effects_named": "library.library",
            "evaluate": "least_squares.evaluate",
            "example_data": "shipped",
            "example_names": "shipped",
            "export": "exporting.export",
            "fit": "least_squares.fit",
            "hill_curves": "hill.hill:curves",
            "plan": "study.plan",
            "quick_look": "posterior.quick",
            "quick_releases": "hill.hill:releases",
            "read_experiment": "recordings.experiment",
            "read_model": "model_files.model_file",
            "read_recording": "recordings.experiment",
            "sample": "posterior.sample",
            "sealed_truth": "shipped",
            "simulate": "study.simulate",
            "use_64_bit": "compiled.prepare",
            "write_model": "model_files.writer",
            "write_muscle_file": "recordings.template",
        },
    )
