"""A small study for the tests of what a user reads: a comparison, and the diagnosis that goes with it."""

import html
import re
from dataclasses import replace

import numpy as np
from small_muscle import loops, write

from fitting.comparison.compare import compare
from fitting.diagnosis.findings import GroupKind, InstrumentAnswer, RestsOn
from fitting.diagnosis.outcomes import NOTHING_MISSING, Reason, Verdict, Why
from fitting.diagnosis.record import Diagnosis, Evidence, Explanation, Leading
from fitting.instruments.sources import ErrorKind, Source
from fitting.planning.next_measurement import NextMeasurement
from fitting.planning.protocols import Protocol
from fitting.problem.estimate import Estimate
from fitting.recordings.accuracy import Channel
from fitting.study.request import Request
from fitting.study.stages import Stage
from fitting.study.task import fit_task, task_of

EVIL = "<script>alert(1)</script> & $x_1 'it'"


def compared(folder):
    """A data set with a nasty name, its task, its comparison."""
    folder = write(folder, loops(lambda eps, *_: 400 * eps, repeats=2), name=EVIL)
    task = task_of(Request(data=(str(folder),), starts=2))
    return task, compare(fit_task(task), task.experiments)


def spring_missing(c):
    """A diagnosis as `diagnose` would give it."""
    best = Explanation(("linear_spring",), rmse=0.31, held_out_rmse=0.32, fall=9.0, p_value=0.4, adequate=True,
                       estimate={"linear_spring.K": Estimate(1600.0, 20.0, "N/m")})  # fmt: skip
    return Diagnosis(
        verdict=Verdict.MISSING, negligible=False, explanations=(("linear_spring",),),
        classes=((("weight",), ("force_offset",)),),
        nearest=(), leading=Leading(("linear_spring",), 0.98, 0.32, 4.0), p_value=0.001, level=0.01,
        rests_on=RestsOn(6, (GroupKind.LOOP,)), rmse=c.rmse, held_out_rmse=1.1 * c.rmse, noise_floor=0.3,
        full_scale=c.full_scale,
        effects={
            "linear_spring": Evidence("linear_spring", 0.01, 0.31, 0.32, 0.2, 0.1, {"end_stop": 0.95},
                                      {"K": Estimate(1600.0, 20.0, "N/m")}, True),
            "viscous_damping": Evidence("viscous_damping", 0.9, c.rmse, 1.1 * c.rmse, 0.2, 0.1),
            "end_stop": Evidence("end_stop", 0.9, c.rmse, 1.1 * c.rmse, 0.2, 0.1, {"linear_spring": 0.95}),
            "mullins": Evidence("mullins", why=Why(Reason.NEEDS, ("rubber",))),
        },
        tried=(best,), baseline=c.fit, residual=c.fit.residual, notes=(),
    )  # fmt: skip


def proposed(power):
    """A loop that would tell a spring from a stop as often as that."""
    protocol = Protocol("loop", (5e4, 5e4), (0.0, 0.2), 0.1)
    return NextMeasurement((("linear_spring",), ("end_stop",)), power, protocol, 1, 0.03, 4.0, ())


GAIN = Source(Channel.FORCE, ErrorKind.GAIN_PER_RUN, 0.001, 0.001)
ZERO = Source(Channel.PRESSURE, ErrorKind.ZERO, 500.0, 500.0)
RULER = Source(Channel.POSITION, ErrorKind.GAIN, 0.0, 0.001)
SILENT = Source(Channel.POSITION, ErrorKind.DRIFT, 0.0, 1e-6)


def seen_through(d, verdict, **changes):
    """A diagnosis with answers of instruments; a verdict that names something has two rivals, the worse one first."""
    missing = verdict not in NOTHING_MISSING
    sizes = [(ZERO, 450.0, None), (RULER, 0.03, 0.04), (GAIN, 0.015, 0.018), (SILENT, 0.0, None)]
    answers = tuple(InstrumentAnswer(source, found, needed if missing else None) for source, found, needed in sizes)
    return replace(d, verdict=verdict, instruments=answers, **changes)


def nothing_missing(d, verdict=Verdict.NOTHING):
    """The same where nothing is missing: one effect hides, one would have been seen from 0.2 N, one from 0.31 N."""
    limits = {"linear_spring": 6.12, "viscous_damping": 0.31, "end_stop": 0.2}
    shown = {name: replace(d.effects[name], detection_limit=limits[name], adequate=False) for name in limits}
    return seen_through(d, verdict, explanations=(), classes=(), leading=None, tried=(), faint=("linear_spring",),
                        effects=d.effects | shown)  # fmt: skip


def without_code(text):
    """A page without its script and the data of it."""
    return re.sub(r"<script.*?</script>", "", text, flags=re.DOTALL)


def as_read(text):
    """What a reader sees of HTML: no tags, and the identifiers behind the names."""
    return html.unescape(re.sub(r"<[^>]*>", "", text))


def headings(text):
    """The headline of every model of the page."""
    return [as_read(found) for found in re.findall(r"<h1>(.*?)</h1>", text)]


def off_by(c, newtons, **changes):
    """The comparison of a model that pulls so much more everywhere."""
    residual = c.fit.residual + newtons
    rmse = float(np.sqrt(np.mean(residual**2)))
    return replace(c, rmse=rmse, fit=replace(c.fit, residual=residual), **changes)


def two_steps(c, diagnosis):
    """A model that is diagnosed, and the one with what it lacked, which the diagnosis has tested."""
    before, p = off_by(c, 4), diagnosis.p_value
    return [Stage("baseline", before.rmse, 6.0, "missing", before, diagnosis=diagnosis, p_value=p),
            Stage("", c.rmse, 1.1, "", c, added=("coulomb_friction",), p_value=0.37)]  # fmt: skip
