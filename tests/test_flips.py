"""The gate: its size under correlated noise, its power, and what its pieces must do by construction."""

from dataclasses import fields, replace
from types import SimpleNamespace

import numpy as np
import pytest

from fitting.diagnosis import omnibus
from fitting.diagnosis.findings import GroupKind, RestsOn
from fitting.diagnosis.flip_groups import FlipGroups, flip_groups, numbered, rests_on_in_words, too_few_to_flip
from fitting.diagnosis.missing_effect import Ground, MissingEffectTest, missing_effect_test
from fitting.diagnosis.nuisance import Nuisance
from fitting.diagnosis.outcomes import Reason, Verdict, Why
from fitting.diagnosis.settings import DIAGNOSIS, FLIP_TEST
from fitting.diagnosis.sign_flips import flipped_signs
from fitting.diagnosis.verdict import _decided
from fitting.instruments.errors import InstrumentErrors
from fitting.least_squares import held_out, working_noise
from fitting.least_squares.decomposed import orthonormal
from fitting.problem.residuals import Samples

LOOPS, PER_HALF = 20, 40


def samples(per_half: int = PER_HALF) -> Samples:
    """Twenty closed loops, five runs of four."""
    n = LOOPS * 2 * per_half
    half = np.repeat(np.arange(LOOPS * 2), per_half)
    up = half % 2 == 0
    ramp = np.tile(np.linspace(0.01, 0.2, per_half), LOOPS * 2)
    run = half // 8
    branch = np.where(up, 1.0, -1.0)
    zero = np.zeros(n)
    return Samples(
        dataset=np.zeros(n, int),
        recording=np.zeros(n, int),
        run=run,
        loop=(half % 8) // 2,
        half=half % 8,
        row=np.arange(n),
        time=np.arange(n) * 0.1,
        contraction=np.where(up, ramp, 0.21 - ramp),
        pressure=1e5 * (1.0 + run),
        rate=branch * np.where(half // 2 % 2, 0.01, 0.03),
        pressure_rate=zero,
        branch=branch,
        measured=zero,
        sigma=zero + 1,
        position=np.concatenate([np.arange(c) for c in np.bincount(run)]),
    )


def autoregression(memory: float, count: int, rng: np.random.Generator) -> np.ndarray:
    e = rng.normal(size=count)
    for i in range(1, count):
        e[i] = memory * e[i - 1] + np.sqrt(1 - memory**2) * e[i]
    return e


def examined(rows: np.ndarray, s: Samples, seed: int) -> MissingEffectTest:
    x, p = s.contraction, s.pressure / 3e5
    slopes = np.stack([p * (1 - x) ** 2, p, s.branch * p], axis=1)
    rows = rows - slopes @ np.linalg.lstsq(slopes, rows, rcond=None)[0]
    columns = np.stack([s.branch * p**0.7, s.branch * s.rate, np.maximum(x - 0.12, 0), x, p * x**3], axis=1)
    basis = omnibus.basis(s)
    noise = working_noise.noise_from(rows, np.hstack([basis.whole, slopes]), s)
    groups = flip_groups(s, noise.memory)
    same = Nuisance(slopes, np.zeros(0), np.zeros((0, 3)))
    return missing_effect_test(rows, same, columns, Ground(s, groups, basis, noise, exact(s), seed))


def exact(s: Samples) -> InstrumentErrors:
    """Instruments that do not err."""
    return InstrumentErrors.none(s.run)


def words(groups: FlipGroups) -> str:
    """What a test by these groups rests on."""
    return rests_on_in_words(groups.rests_on())


@pytest.mark.parametrize("memory", [0.0, 0.9, 0.97])
def test_false_alarms_are_rare_under_correlated_noise(memory):
    """Nominal 1 %: of 40 clean sets at most 3 may be rejected (a test of that size does so with probability 0.999)."""
    s = samples()
    rng = np.random.default_rng(int(100 * memory))
    rejected = sum(examined(autoregression(memory, len(s), rng), s, seed).rejected for seed in range(40))
    assert rejected <= 3


@pytest.mark.parametrize("column", [0, 1, 2, 3])
def test_a_clear_effect_is_seen(column):
    """An effect of one noise sigma after the model's own parameters have given way, in noise of memory 0.7."""
    s = samples()
    x, p = s.contraction, s.pressure / 3e5
    shape = [s.branch * p**0.7, s.branch * s.rate, np.maximum(x - 0.12, 0), x][column]
    slopes = np.stack([p * (1 - x) ** 2, p, s.branch * p], axis=1)
    left = shape - slopes @ np.linalg.lstsq(slopes, shape, rcond=None)[0]
    rng = np.random.default_rng(column)
    rows = autoregression(0.7, len(s), rng) + 1.5 * left / np.sqrt(np.mean(left**2))
    verdict = examined(rows, s, 0)
    assert verdict.rejected
    assert verdict.p_effects[column] < 0.01


@pytest.mark.parametrize("odd", [False, True])
def test_a_ripple_is_seen_and_not_taken_for_noise(odd):
    """Ten periods over the stroke: no smooth basis follows it, and a noise model takes it for noise."""
    s, random = samples(120), np.random.default_rng(8)
    ripple = np.sin(2 * np.pi * s.contraction / 0.02) * (s.branch if odd else 1.0)
    rows = autoregression(0.5, len(s), random) + ripple
    assert examined(rows - 0.7 * ripple, s, 0).rejected  # so little that nothing smooth catches any of it
    assert examined(rows, s, 0).floor == pytest.approx(1.0, abs=0.1)
    basis = omnibus.basis(s)
    blind, seeing = (working_noise.noise_from(rows, b, s) for b in (basis.smooth, basis.whole))
    assert blind.white + blind.shares.sum() > 1.4  # what it would be taken for
    assert seeing.white + seeing.shares.sum() == pytest.approx(1.0, abs=0.1)


def test_what_a_turning_point_leaves_is_seen_and_not_taken_for_noise():
    """A lag that dies away over a fiftieth of the range after turns that are nowhere the same."""
    random = np.random.default_rng(8)
    s = samples(120)
    loop = s.run * 4 + s.loop
    s = replace(s, contraction=0.01 + (s.contraction - 0.01) * random.uniform(0.4, 1.0, LOOPS)[loop])
    top = np.array([s.contraction[loop == one].max() for one in range(LOOPS)])[loop]
    lag = np.where(s.branch < 0, 4.0 * np.exp(-(top - s.contraction) / 0.004), 0.0)
    rows = autoregression(0.5, len(s), random) + lag
    assert examined(rows, s, 0).floor == pytest.approx(1.0, abs=0.1)
    assert examined(rows - 0.8 * lag, s, 0).p_omnibus < 0.005


@pytest.mark.parametrize("units", [1, 2, 5, 11])
def test_few_units_are_flipped_in_every_way(units):
    """Once each, up to one sign for all; the first flip is none."""
    signs = flipped_signs(units, 0)
    assert np.all(signs[0] == 1)
    assert len({tuple(row * row[-1]) for row in signs}) == len(signs) == 2 ** (units - 1)


def stated(rows, amount, error, s, seed):
    """A model of one parameter that is stated to one standard error, which the data know about as well."""
    x = s.contraction
    slope = (x - x.mean()) / np.linalg.norm(x - x.mean())
    column = slope + 0.2 * np.sin(40 * x) / np.linalg.norm(np.sin(40 * x))
    prior = np.array([error])
    fit = np.linalg.lstsq(np.append(slope, 1.0)[:, None], np.append(rows + amount * column, prior), rcond=None)[0]
    left = rows + amount * column - slope * fit[0]
    same = Nuisance(slope[:, None], prior - fit, np.ones((1, 1)))
    basis = omnibus.basis(s)
    noise = working_noise.white_noise(1.0)
    return missing_effect_test(
        left, same, column[:, None], Ground(s, flip_groups(s, 0.0), basis, noise, exact(s), seed)
    )


def test_errors_in_what_is_stated_raise_no_alarm_and_hide_nothing():
    """Where data and statement weigh the same an error of the statement sways the score most: by half a sigma each."""
    s, random = samples(), np.random.default_rng(9)
    clean = [stated(random.normal(size=len(s)), 0.0, random.normal(), s, seed).p_effects[0] for seed in range(60)]
    assert np.mean(np.array(clean) < 0.05) <= 0.15
    for error in (-3.0, 3.0):
        assert stated(random.normal(size=len(s)), 12.0, error, s, 0).p_effects[0] < 0.01


def test_the_noise_model_finds_its_memory():
    """A long first-order autoregression is recognised."""
    s = samples()
    noise = working_noise.noise_from(autoregression(0.9, len(s), np.random.default_rng(3)), np.zeros((len(s), 0)), s)
    assert noise.memory == pytest.approx(0.9, abs=0.08)


def two_runs() -> Samples:
    """Two pressures, two equal loops each: too few to be flipped."""
    per = 200
    n = 8 * per
    half = np.repeat(np.arange(8), per)
    up, run, zero = half % 2 == 0, half // 4, np.zeros(n, int)
    ramp = np.tile(np.linspace(0.01, 0.25, per), 8)
    branch = np.where(up, 1.0, -1.0)
    return Samples(
        dataset=zero, recording=zero, run=run, loop=half // 2, half=half, row=np.arange(n), time=np.arange(n) * 0.01,
        contraction=np.where(up, ramp, 0.26 - ramp), pressure=2e5 * (1.0 + run), rate=0.01 * branch,
        pressure_rate=zero.astype(float), branch=branch, measured=zero.astype(float), sigma=np.ones(n),
        position=np.arange(n) % (4 * per),
    )  # fmt: skip


def test_slow_noise_in_few_loops_is_seldom_an_effect():
    """A smooth basis takes slow noise with it; were that not given back, two of three would be false alarms."""
    s, random = two_runs(), np.random.default_rng(6)
    slow = lambda: np.concatenate([autoregression(0.99, len(s) // 2, random) for _ in range(2)])  # noqa: E731
    rejected = [examined(random.normal(size=len(s)) + slow(), s, seed).rejected for seed in range(40)]
    assert np.mean(rejected) <= 0.15


def test_whitening_leaves_nothing_correlated():
    """Whitened by the true covariance, neighbours are independent and of unit variance."""
    s = samples()
    share = np.zeros(len(working_noise.NOISE.memories))
    share[list(working_noise.NOISE.memories).index(0.9)] = 1.0
    rows = autoregression(0.9, len(s), np.random.default_rng(4))[:, None]
    white = working_noise.Whitener.of(working_noise.Noise(1e-6, share), s, numbered(s.run, s.loop))(rows)[:, 0]
    assert np.std(white) == pytest.approx(1.0, abs=0.05)
    assert abs(np.corrcoef(white[1:], white[:-1])[0, 1]) < 0.06


def test_few_loops_flip_smaller_units_and_say_so():
    """Below twelve loops half loops, below twelve half loops blocks of samples at the stricter level."""
    s = samples()
    some = s.where(s.run < 2)
    few = s.where(s.run < 1)
    assert "half loops" in words(flip_groups(some, 0.5))
    blocks = flip_groups(few.where(few.half < 4), 0.5)
    assert "noise model" in words(blocks)
    assert blocks.level == FLIP_TEST.level_of_blocks
    assert "blocks of 24 samples" in words(
        flip_groups(few.where(few.half < 4), 0.5)
    )  # 8 correlation times, (1+m)/(1-m)
    assert "blocks of 56 samples" in words(flip_groups(few.where(few.half < 4), 0.75))
    assert "blocks of 20 samples" in words(flip_groups(few.where(few.half < 4), 0.0))


def test_a_few_loops_beside_many_isometric_cycles_are_flipped_by_halves():
    """Flipped whole, four of them could never show what only loops show; the cycles stay whole, and the noise too."""
    s = samples()
    loops = s.where(s.run < 1)
    held = replace(s, rate=0 * s.rate, pressure_rate=1e4 * s.branch, run=s.run + 1, recording=s.recording + 1)
    both = Samples(*(np.concatenate([getattr(part, f.name) for part in (loops, held)]) for f in fields(Samples)))
    found = flip_groups(both, 0.5)
    halves = len(np.unique(numbered(loops.run, loops.half)))
    cycles = len(np.unique(numbered(held.run, held.loop)))
    assert halves < FLIP_TEST.fewest_groups <= cycles
    assert found.count == halves + cycles
    assert "loops and half loops" in words(found)
    points = replace(
        s.where(np.arange(30)), rate=np.zeros(30), run=np.arange(30) + 1, half=np.arange(30), recording=np.ones(30, int)
    )
    mixed = Samples(*(np.concatenate([getattr(part, f.name) for part in (loops, points)]) for f in fields(Samples)))
    assert "half loops and single points flipped" in words(flip_groups(mixed, 0.5))
    assert words(flip_groups(points, 0.5)) == "signs of 30 single points flipped"
    assert len(np.unique(found.together)) == len(np.unique(loops.run)) + cycles


def test_left_out_rows_are_those_of_a_refit():
    """Of a linear model, exactly."""
    rng = np.random.default_rng(5)
    design = rng.normal(size=(60, 3))
    y = design @ [1.0, -2.0, 0.5] + rng.normal(size=60)
    group = np.repeat(np.arange(6), 10)
    rows = design @ np.linalg.lstsq(design, y, rcond=None)[0] - y
    none = np.zeros((0, 3))
    left = held_out.left_out_rows(rows, design, np.zeros(0), none, group)
    for g in range(6):
        inside, out = group != g, group == g
        refit = np.linalg.lstsq(design[inside], y[inside], rcond=None)[0]
        np.testing.assert_allclose(left[out], design[out] @ refit - y[out], rtol=1e-8)


def test_a_basis_has_no_more_columns_than_its_span():
    """Copies and sums add nothing, and neither does what rounding leaves of them."""
    own = np.random.default_rng(6).normal(size=(50, 3))
    found = orthonormal(np.column_stack([own, own[:, 0] + 1e-9 * own[:, 1], own @ [1e3, 2.0, 3.0]]))
    assert found.shape == (50, 3)
    assert np.allclose(found.T @ found, np.eye(3))
    assert np.allclose(found @ (found.T @ own), own)


def test_slow_noise_keeps_a_thousandth_of_white_noise():
    """Whatever its size: or nothing of it could be whitened."""
    s = samples()
    slow = np.sin(np.arange(len(s)) / 300.0)  # no white noise at all
    constant = np.ones((len(s), 1))
    small, large = (working_noise.noise_from(size * slow, constant, s) for size in (1.0, 30.0))
    assert small.white == pytest.approx(1e-3 * np.mean((slow - slow.mean()) ** 2), rel=0.01)
    assert large.white == pytest.approx(900 * small.white)


@pytest.mark.parametrize(
    ("found", "said"),
    [
        (RestsOn(1, (GroupKind.BLOCK,), 20),
         "1 block of 20 samples is too few to flip: p is that of the noise model alone"),
        (RestsOn(8, (GroupKind.BLOCK,), 20),
         "8 blocks of 20 samples are too few to flip: p is that of the noise model alone"),
        (RestsOn(9, (GroupKind.BLOCK,), 20),
         "signs of 9 blocks of 20 samples flipped: too few loops, this rests on the noise model"),
        (RestsOn(6, (GroupKind.POINT,)), "signs of 6 single points flipped"),
    ],
)  # fmt: skip
def test_a_small_p_of_few_blocks_is_not_said_to_be_of_flips(found, said):
    """One sign gives no p below one half; p = 0.0005 was said to be of it."""
    assert rests_on_in_words(found) == said
    assert too_few_to_flip(found) == ("too few to flip" in said)


@pytest.mark.parametrize(("groups", "verdict"), [(8, Verdict.INCONCLUSIVE), (9, Verdict.NOT_IN_LIBRARY)])
def test_what_blocks_too_few_to_flip_reject_is_not_said_to_be_nobodys(groups, verdict):
    """Twenty samples of one quick release were, and the drag that was hidden in them is in the library."""
    search = SimpleNamespace(
        world=SimpleNamespace(samples=range(300)),
        base=SimpleNamespace(free=("a",)),
        base_is_adequate=False,
        missing_effect_test=SimpleNamespace(rejected=True),
        examiner=SimpleNamespace(settings=DIAGNOSIS, rests_on=RestsOn(groups, (GroupKind.BLOCK,), 20)),
    )
    found, why = _decided(search, [])
    assert found == verdict
    assert why == (Why(Reason.FEW_LOOPS) if verdict == Verdict.INCONCLUSIVE else None)
    assert _decided(search, [frozenset(["tip"])])[0] == Verdict.MISSING
