"""Data sets laid out with a model's effects and with all that may be missing from it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fitting.diagnosis.outcomes import Reason, Why
from fitting.diagnosis.settings import FITS, FitSettings
from fitting.diagnosis.universe import Universe
from fitting.instruments.columns import most_errors, most_independent
from fitting.instruments.through import SIZES, Through, standard_number
from fitting.least_squares.instruments import accuracies_of
from fitting.problem.residuals import problem
from fitting.problem.sizes import of_standard_size
from fitting.problem.unknowns import unknowns
from fitting.problem.varying import AS_DECLARED, Varying
from fitting.recordings.hoses import with_hose_sizes
from fitting.recordings.records import Experiment, force_was_measured
from mckibben_jax.effect import Effect, name_of
from mckibben_jax.muscle import quantities

STAND_INS = {  # SI; numbers like those of a usual muscle
    "wall_thickness": 1e-3, "shear_modulus": 5e5, "mooney_c10": 1e5, "mooney_c01": 1e4, "strand_width": 3e-4,
    "strand_modulus": 2e9, "strand_poisson": 0.35, "breaking_stress": 3e7,
}  # fmt: skip


def universe(
    experiments: Sequence[Experiment],
    effects: Sequence[Effect],
    candidates: Sequence[Effect],
    varying: Varying = AS_DECLARED,
    settings: FitSettings = FITS,
) -> Universe:
    """Lay out data sets with the effects of a model and all that may be missing from it.

    What cannot be tested stands in the layout too, switched off for good: all data sets then have one compiled program.
    """
    experiments = with_hose_sizes(experiments)
    present = [name_of(effect) for effect in effects]
    others = [effect for effect in candidates if name_of(effect) not in present]
    reasons = {name_of(effect): _why_not(effect, experiments) for effect in others}
    untestable = {name: why for name, why in reasons.items() if why is not None}
    whole = [_with_stand_ins(experiment) for experiment in experiments]
    layout = unknowns(whole, [*effects, *others], varying.own)
    given, samples = problem(whole, layout)
    given, real = of_standard_size(given)
    muscle = [name for name in varying.names(layout) if name.startswith("muscle.")]
    accuracies = accuracies_of(experiments)
    lost = sum(effect.stage == "lost" for effect in effects)
    runs = len(np.unique(samples.run))
    room = standard_number(most_errors(accuracies, runs, lost)) or SIZES[0]
    held = sum(len(r.runs) for e in experiments for r in e.recordings if r.test == "isometric")
    independent = standard_number(most_independent(accuracies, runs, held, lost)) or SIZES[0]
    return Universe(
        layout,
        given,
        real,
        samples,
        tuple(present),
        tuple(name for name in layout.templates[0].names if name not in {*present, *untestable}),
        untestable,
        tuple(muscle),
        tuple(name for name in layout.names if varying.holds(name)),
        layout.start.copy(),
        frozenset(name for name in quantities() if not any(e.muscle.lacks(name) for e in experiments)),
        np.array([float(experiment.muscle.length) for experiment in experiments]),
        accuracies,
        room,
        Through.nothing(given.count, min(room, independent)),
        settings,
        any(experiment.is_confined for experiment in experiments),
    )


def _with_stand_ins(experiment: Experiment) -> Experiment:
    """The data set with a number for whatever was not measured of its muscle: what would need it is never tested."""
    given = {name: value for name, value in STAND_INS.items() if experiment.muscle.lacks(name)}
    return replace(experiment, muscle=replace(experiment.muscle, **given))


def _why_not(effect: Effect, experiments: Sequence[Experiment]) -> Why | None:
    """Which measurement of the muscle an effect needs that a data set does not give; None where it lacks none."""
    missing = [need for need in effect.needs if need in quantities() and any(e.muscle.lacks(need) for e in experiments)]
    if missing:
        return Why(Reason.NEEDS, tuple(missing))
    if effect.stage == "read" and not force_was_measured(experiments):
        return Why(Reason.NO_FORCE)
    return None
