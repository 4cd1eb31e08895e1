"""A fitted muscle as one C99 header: no memory is allocated, no file read, and nothing is kept between calls."""

from string import Template

import numpy as np

from fitting.exporting.c_family import family_in_c, undefined_in_c
from fitting.exporting.c_operations import HELPERS
from fitting.exporting.c_source import c_source
from fitting.exporting.draws import LENGTH, Draws
from fitting.exporting.laws import NOTHING, RIG, Told, laws, memory_shapes, title
from mckibben_jax.model import Model


def c_header(whole: Model, source: str, name: str = "muscle", told: Told = NOTHING) -> str:
    """The text of a header whose functions begin with `name`; `source` says where the model is from."""
    shapes, draws = memory_shapes(whole), told.draws
    sizes = {**dict.fromkeys((*RIG, "direction"), 1), **{key: int(np.prod(shape)) for key, shape in shapes.items()}}
    count = sum(sizes.values())
    names, kind = ((), "law") if draws is None else (draws.names, "drawn")
    own = [
        law.source(whole, "C", lambda law_name, *rest: c_source(f"{name}_{kind}{law_name}", *rest))
        for law in laws(whole, names)
    ]
    return _TEMPLATE.substitute(
        title="\n".join(f" * {line}".rstrip() for line in title(whole, source, told).replace("*/", "* /").splitlines()),
        n=name,
        N=name.upper(),
        length=_length(whole, name, draws),
        error=f"(({name}_real){told.error.newtons!r})" if np.isfinite(told.error.newtons) else "NAN",
        family="" if draws is None else family_in_c(whole, name, draws),
        undefine="" if draws is None else undefined_in_c(name),
        kept="kept between calls" if draws is None else "kept between calls but the choice of a draw",
        memories="".join(f"\n    {name}_real {key}{_size(shape)}; /* remembered */" for key, shape in shapes.items()),
        remembered=max(sum(sizes[key] for key in shapes), 1),
        count=count,
        all=", ".join(f"state->{key}" for key in sizes),
        unpack="\n".join(_copies(sizes, shapes, 0)),
        start="\n".join(_copies({key: sizes[key] for key in shapes}, shapes, 0, "state.")),
        laws="\n\n".join(own),
        helpers=HELPERS,
    )


def _length(whole: Model, name: str, draws: Draws | None) -> str:
    if draws is not None and LENGTH in draws.names:
        return f"({name}_now[{draws.names.index(LENGTH)}])"
    return f"(({name}_real){float(whole.muscle.length)!r})"


def _size(shape: tuple[int, ...]) -> str:
    return f"[{int(np.prod(shape))}]" if shape else ""


def _copies(sizes: dict[str, int], shapes: dict[str, tuple[int, ...]], first: int, of: str = "state->") -> list[str]:
    lines = []
    for key, size in sizes.items():
        places = [f"{key}[{i}]" for i in range(size)] if shapes.get(key) else [key]
        lines += [f"    {of}{place} = out[{first + i}];" for i, place in enumerate(places)]
        first += size
    return lines


_TEMPLATE = Template("""/* A McKibben muscle in C99: step, force, stiffness, linearise, pressure_for.
 *
$title
 *
 * Compile as it is for double, with -D${N}_FLOAT for float; not with -ffast-math. No memory is allocated, nothing is
 * $kept: what a muscle remembers is in the ${n}_state that you hand in.
 *
 * Signs: contraction is (l0 - l)/l0 and displacement l0 - l, both positive when shorter; force is positive when
 * pulling. direction is the way of the braid: 1 contracting, -1 elongating, 0 at rest without friction.
 * Dry friction turns round with any motion: a displacement that jitters, as a sensor's does, makes the force of step
 * jump by twice the friction. Give a smooth one. A step takes time: with dt = 0 it gives NaN.
 *
 *     ${n}_state state = ${n}_start(2e5, 0.0);               // 2 bar, rest length
 *     double newton = ${n}_step(&state, 3e5, 0.01, 1e-3);    // a millisecond later: 3 bar, 10 mm shorter
 */
#ifndef ${N}_H
#define ${N}_H

#include <float.h>
#include <math.h>

#ifdef ${N}_FLOAT
typedef float ${n}_real;
#define MK_F(name) name##f
#define MK_SMALL(x) 1.17549435e-38
#define MK_LARGE(x) 3.40282347e+38
#define MK_CLOSE 1e-7 /* of the highest pressure: how closely a pressure is found */
#else
typedef double ${n}_real;
#define MK_F(name) name
#define MK_SMALL(x) x
#define MK_LARGE(x) x
#define MK_CLOSE 1e-13
#endif
#define MK_REAL ${n}_real
#define MK_C(x) ((MK_REAL)(x))

#define ${N}_LENGTH $length /* m, at rest */
#define ${N}_HIGHEST_PRESSURE ((${n}_real)1e6) /* Pa: pressures are looked for from 0 to here */
/* N, the largest force error to expect: what it is and how it was found stands above. NAN: not known. */
#define ${N}_FORCE_ERROR $error
$family
/* What one step leaves to the next. direction is that of friction, kept while the muscle stands. */
typedef struct {
    ${n}_real contraction;
    ${n}_real pressure; /* Pa */
    ${n}_real rate; /* 1/s */
    ${n}_real pressure_rate; /* Pa/s */
    ${n}_real time; /* s */
    ${n}_real direction;$memories
} ${n}_state;

/* Near a state: force - stiffness dx + gain dP - damping dv, x and v the displacement and its speed. */
typedef struct {
    ${n}_real force; /* N */
    ${n}_real stiffness; /* N/m */
    ${n}_real gain; /* N/Pa */
    ${n}_real damping; /* N s/m */
} ${n}_linear;

/* ---- the arithmetic, as it was traced ---- */

#define mk_square ${n}_mk_square
#define mk_sign ${n}_mk_sign
#define mk_max ${n}_mk_max
#define mk_min ${n}_mk_min
#define mk_finite ${n}_mk_finite
#define mk_power ${n}_mk_power
$helpers
$laws

/* ---- for use ---- */

/* The state of a muscle that has stood at this pressure (Pa) and displacement (m) for long. */
static inline ${n}_state ${n}_start(MK_REAL pressure, MK_REAL displacement) {
    ${n}_state state;
    MK_REAL out[$remembered];
    state.contraction = displacement / ${N}_LENGTH;
    state.pressure = pressure;
    state.rate = state.pressure_rate = state.time = state.direction = 0;
    ${n}_law_start(state.contraction, pressure, out);
$start
    return state;
}

static inline void ${n}_keep(${n}_state *state, const MK_REAL *out) {
$unpack
}

/* The force (N) after dt seconds in which pressure (Pa) and displacement (m) went straight here; NaN unless dt > 0.
 * Friction keeps its direction while the braid stands. The state is brought up to date. */
static inline MK_REAL ${n}_step(${n}_state *state, MK_REAL pressure, MK_REAL displacement, MK_REAL dt) {
    MK_REAL out[$count + 1];
    if (!(dt > 0)) return MK_C(NAN);
    ${n}_law_step($all, pressure, displacement, dt, out);
    ${n}_keep(state, out);
    return out[$count];
}

/* As ${n}_step, with the force in two: the pull without dry friction is returned, how much dry friction can resist is
 * written to *friction, both N. The force is pull - direction * friction; a simulator takes the second as a budget. */
static inline MK_REAL ${n}_step_parts(${n}_state *state, MK_REAL pressure, MK_REAL displacement, MK_REAL dt,
                                      MK_REAL *friction) {
    MK_REAL out[$count + 2];
    if (!(dt > 0)) return *friction = MK_C(NAN);
    ${n}_law_parts($all, pressure, displacement, dt, out);
    ${n}_keep(state, out);
    *friction = out[$count + 1];
    return out[$count];
}

/* Force, N, of slow motion in a direction; rate (1/s, positive when contracting) adds what depends on speed. */
static inline MK_REAL ${n}_force(MK_REAL contraction, MK_REAL pressure, MK_REAL direction, MK_REAL rate) {
    MK_REAL out[1];
    ${n}_law_force(contraction, pressure, direction, rate, out);
    return out[0];
}

/* Force of slow motion and its slopes. */
static inline ${n}_linear ${n}_linearise(MK_REAL contraction, MK_REAL pressure, MK_REAL direction, MK_REAL rate) {
    ${n}_linear near;
    MK_REAL out[4];
    ${n}_law_linearised(contraction, pressure, direction, rate, out);
    near.force = out[0];
    near.stiffness = -out[1];
    near.gain = out[2];
    near.damping = -out[3];
    return near;
}

/* How much more it pulls per metre that it is longer, N/m, at constant pressure. */
static inline MK_REAL ${n}_stiffness(MK_REAL contraction, MK_REAL pressure, MK_REAL direction) {
    return ${n}_linearise(contraction, pressure, direction, 0).stiffness;
}

/* The pressure, Pa, at which a muscle in slow motion pulls with this force (N); NaN where none up to
 * ${N}_HIGHEST_PRESSURE does. */
static inline MK_REAL ${n}_pressure_for(MK_REAL force, MK_REAL contraction, MK_REAL direction) {
    MK_REAL low = 0, high = ${N}_HIGHEST_PRESSURE, found, closer = 0;
    const MK_REAL least = ${n}_force(contraction, low, direction, 0);
    const MK_REAL most = ${n}_force(contraction, high, direction, 0);
    if (!(least <= force && force <= most)) return MK_C(NAN);
    found = high * (force - least) / (most > least ? most - least : MK_C(1));
    for (int turn = 0; turn < 200; ++turn) {
        const ${n}_linear here = ${n}_linearise(contraction, found, direction, 0);
        if (here.force < force) low = found; else high = found;
        closer = found + (force - here.force) / here.gain;
        if (!(low <= closer && closer <= high)) closer = (low + high) / 2;
        if (MK_F(fabs)(closer - found) <= MK_C(MK_CLOSE) * ${N}_HIGHEST_PRESSURE) break;
        found = closer;
    }
    return closer;
}

/* The pressure, Pa, with which the next step, dt seconds long and to this displacement (m), ends with this force (N):
 * what the muscle remembers and the direction of its friction are taken into account. The state is left as it is. NaN
 * where no pressure up to ${N}_HIGHEST_PRESSURE does it. */
static inline MK_REAL ${n}_pressure_for_step(const ${n}_state *state, MK_REAL force, MK_REAL displacement, MK_REAL dt) {
    MK_REAL low = 0, high = ${N}_HIGHEST_PRESSURE, below, above, found;
    ${n}_state next = *state;
    below = ${n}_step(&next, low, displacement, dt) - force;
    next = *state;
    above = ${n}_step(&next, high, displacement, dt) - force;
    if (!(below <= 0 && above >= 0)) return MK_C(NAN);
    for (int turn = 0; turn < 200 && high - low > MK_C(MK_CLOSE) * ${N}_HIGHEST_PRESSURE; ++turn) {
        MK_REAL off;
        found = turn % 3 == 2 || !(above > below) ? (low + high) / 2 : low - below * (high - low) / (above - below);
        next = *state;
        off = ${n}_step(&next, found, displacement, dt) - force;
        if (off == 0) return found;
        if (off < 0) { low = found; below = off; } else { high = found; above = off; }
    }
    return (low + high) / 2;
}

$undefine#undef mk_square
#undef mk_sign
#undef mk_max
#undef mk_min
#undef mk_finite
#undef mk_power
#undef MK_REAL
#undef MK_F
#undef MK_C
#undef MK_SMALL
#undef MK_LARGE
#undef MK_CLOSE
#endif
""")
