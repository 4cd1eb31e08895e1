import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium")

with app.setup(hide_code=True):
    import jax
    import marimo as mo
    import matplotlib.pyplot as plt
    import numpy as np

    from fitting import use_64_bit
    from fitting.report import BLUE, GREEN, GREY, ORANGE, SKY, VERMILION
    from mckibben_jax.laws import braid, rubber, working_pressure

    use_64_bit()

    # one program for each law: compiled operation by operation they took a quarter of a minute
    fibre_reinforced_force = jax.jit(working_pressure.fibre_reinforced_force)
    minimum_pressure = jax.jit(working_pressure.minimum_pressure)
    thick_wall_force, thick_elastic_force = jax.jit(rubber.thick_wall_force), jax.jit(rubber.thick_elastic_force)
    ANGLE, WIDE = np.radians(20), np.radians(30)
    RADIUS, PRESSURE, MODULUS = 0.01, 3e5, 0.54e6  # m, Pa, Pa: 45 IRHD
    WALLS = np.geomspace(1e-4, 0.3, 25)
    THIN, PAPER, THICK = 0.01, 0.1, 0.28  # walls over the radius: a membrane, the review's, Chou and Hannaford's


@app.cell
def _(answer):
    if not mo.running_in_notebook():
        print(answer)
    mo.md(f"# Does the fibre-reinforced tube of Liu and Rahn agree with the mechanical approach?\n\n{answer}")
    return


@app.cell
def _(apart, away, membranes, pressures):
    answer = sentence(apart, away, membranes, pressures)
    return (answer,)


@app.cell
def _():
    mo.md("""
    ## Two ways to one force

    *By stresses* (Liu & Rahn): a rubber tube at large strain, inextensible fibres on it; hoop balance gives the tension
    of the net, and the net, the wall and the pressure on the end give the force. *By energy*: the gas's P dV at the outer
    radius and the energy stored in the thick wall (32T). The review calls the comparison "still lacking".
    """)
    return


@app.cell
def _():
    apart = largest_difference()
    return (apart,)


@app.cell
def _():
    shares()
    return


@app.cell
def _():
    mo.md("""
    Where the force comes from, at 3 bar with a wall of 0.28 of the radius: what the net, the wall and the end carry. The
    line is the energy's; the sum of the three (dots) lies on it.
    """)
    return


@app.cell
def _():
    mo.md("""
    ## The review's mechanical approach: 18 and 28 as printed

    Eq 18 takes the wall to carry nothing and 28 adds an axial force alone. Both against the balance of stresses.
    """)
    return


@app.cell
def _():
    away = {wall: printed_error(wall) for wall in (THIN, PAPER, THICK)}
    return (away,)


@app.cell
def _():
    against_printed()
    return


@app.cell
def _():
    mo.md("""
    ## The limit of a thin wall

    Elastic force at a contraction of 0.1 by three thin-wall laws over that of the thick wall; right, the pressure that
    presses the tube against a braid of 30 deg at the end of its stroke, over G h0.
    """)
    return


@app.cell
def _():
    membranes = {wall: thin_over_thick(wall) for wall in (THIN, PAPER, THICK)}
    pressures = end_pressures(1e-4)
    return membranes, pressures


@app.cell
def _():
    thin_limit()
    return


@app.function
def by_stresses(contraction, pressure, wall_ratio, angle=ANGLE, c10=MODULUS / 2, c01=0.0):
    """Pull of the fibre-reinforced tube, N."""
    return fibre_reinforced_force(contraction, pressure, RADIUS, angle, wall_ratio, c10, c01)


@app.function
def largest_difference(count=400, seed=0):
    """Largest difference of the two ways over random muscles, as a share of the force at rest."""
    draw = np.random.default_rng(seed)
    angle, wall = draw.uniform(np.radians(15), np.radians(40), count), draw.uniform(0.001, 0.4, count)
    contraction = draw.uniform(0, 1, count) * np.array(braid.largest_contraction(angle))
    pressure, c10, c01 = draw.uniform(0.5e5, 8e5, count), draw.uniform(1e5, 7e5, count), draw.uniform(0, 2e5, count)
    stresses = by_stresses(contraction, pressure, wall, angle, c10, c01)
    energy = thick_wall_force(contraction, pressure, RADIUS, angle, wall, c10, c01)
    return float(np.max(np.abs(stresses - energy) / braid.ideal_force(0.0, pressure, RADIUS, angle)))


@app.function
def printed_force(contraction, pressure, wall_ratio):
    """The review's pull: eq 18 with the exact bore, and eq 28, N."""
    bore = rubber.inner_radius(contraction, RADIUS, ANGLE, wall_ratio)
    gas = braid.real_force_printed(contraction, pressure, RADIUS, ANGLE, bore)
    return gas + rubber.axial_elastic_force_printed(contraction, RADIUS, ANGLE, wall_ratio, MODULUS)


@app.function
def printed_error(wall_ratio):
    """Printed pull minus that of the balance of stresses, % of the ideal force at rest: at contraction 0 and 0.1."""
    at = np.array([0.0, 0.1])
    gap = printed_force(at, PRESSURE, wall_ratio) - by_stresses(at, PRESSURE, wall_ratio)
    return np.array(100 * gap / braid.ideal_force(0.0, PRESSURE, RADIUS, ANGLE))


@app.function
def thin_over_thick(wall_ratio, contraction=0.1):
    """Elastic force by the thin energy (28E), the concise law (32) and the printed 28, over the thick wall's (32T)."""
    place = (contraction, RADIUS, ANGLE, wall_ratio)
    thick = thick_elastic_force(*place, MODULUS / 2, 0.0)
    laws = (
        rubber.thin_elastic_force(*place, MODULUS),
        rubber.concise_elastic_force(*place, MODULUS / 2, 0.0),
        rubber.axial_elastic_force_printed(*place, MODULUS),
    )
    return np.array([np.array(law / thick) for law in laws])


@app.function
def end_pressures(wall_ratio, angle=WIDE):
    """Pressure that fills the braid at the end of its stroke over G h0: thick wall, 23 corrected, 23 as printed."""
    end = braid.largest_contraction(angle)
    found = (
        minimum_pressure(end, angle, wall_ratio, 0.5, 0.0),
        working_pressure.minimum_pressure_thin(end, angle, wall_ratio, 1.0),
        working_pressure.minimum_pressure_thin_printed(end, angle, wall_ratio, 1.0),
    )
    return np.array([np.array(pressure / wall_ratio) for pressure in found])


@app.function
def sentence(apart, away, membranes, pressures):
    """The answer: every number, and every verdict, out of the results."""
    same = "**They are one law**" if apart < 1e-9 else "**They differ**"
    rest, later = away[PAPER]
    thin, concise, printed = membranes[THICK]
    corrected, misprint = (100 * abs(p / pressures[0] - 1) for p in pressures[1:])
    return f"""
{same}: the balance of stresses in a tube with inextensible fibres and the energy of gas and thick wall (32T) differ by
at most {apart:.0e} of the force at rest over 400 random muscles with walls up to 0.4 of the radius.

- The review's own mechanical approach is not that law: printed 18 with 28 pulls {rest:+.1f} % of the force at rest
  without contraction and {later:+.1f} % at a contraction of 0.1 (wall 0.1 of the radius, 45 IRHD, 3 bar).
- Thin-wall laws tend to it: at a wall of {THIN} the thin energy (28E) has {membranes[THIN][0]:.3f} of the elastic force
  and the concise law (32) {membranes[THIN][1]:.3f}; at {THICK}, {thin:.2f} and {concise:.2f}. Printed 28 has
  {membranes[THIN][2]:.2f} and {printed:.2f}, however thin the wall.
- The pressure that fills the braid: in the thin limit (wall 1e-4, 30 deg) the corrected 23 is {corrected:.2f} % from the
  exact tube, the printed one {misprint:.0f} %.
"""


@app.function
def shares(wall_ratio=THICK):
    """What net, wall and end carry over contraction."""
    eps = np.linspace(0, 0.36, 60)
    rest = (PRESSURE, RADIUS, ANGLE, wall_ratio, MODULUS / 2, 0.0)
    whole, wall = by_stresses(eps, PRESSURE, wall_ratio), working_pressure.wall_axial_force(eps, *rest)
    end = -np.pi * rubber.inner_radius(eps, RADIUS, ANGLE, wall_ratio) ** 2 * PRESSURE
    figure, axes = plt.subplots(figsize=(6.5, 3.6), layout="constrained")
    for force, colour, label in (
        (whole - wall - end, BLUE, "net"),
        (wall, GREEN, "wall"),
        (end, ORANGE, "pressure on the end"),
    ):
        axes.plot(eps, force, color=colour, label=label)
    axes.plot(eps, thick_wall_force(eps, *rest), color="black", label="by energy (32T)")
    axes.plot(eps[::4], whole[::4], "o", color=VERMILION, markersize=4, label="by stresses, sum")
    axes.axhline(0, color=GREY, linewidth=0.6)
    axes.set(xlabel="contraction", ylabel="force [N]")
    axes.legend(fontsize=8)
    return figure


@app.function
def against_printed():
    """The printed mechanical approach and the balance of stresses."""
    eps = np.linspace(0, 0.38, 80)
    figure, panels = plt.subplots(1, 2, figsize=(9, 3.4), sharey=True, layout="constrained")
    for axes, wall in zip(panels, (PAPER, THICK), strict=True):
        axes.plot(eps, braid.ideal_force(eps, PRESSURE, RADIUS, ANGLE), ":", color=GREY, label="ideal (10)")
        axes.plot(eps, printed_force(eps, PRESSURE, wall), color=VERMILION, label="printed 18 + 28")
        axes.plot(eps, by_stresses(eps, PRESSURE, wall), color=BLUE, label="by stresses = by energy")
        axes.axhline(0, color=GREY, linewidth=0.6)
        axes.set(title=f"wall {wall} of the radius", xlabel="contraction")
    panels[0].set_ylabel("force [N]")
    panels[0].legend(fontsize=8)
    return figure


@app.function
def thin_limit():
    """Thin-wall laws over the thickness of the wall."""
    forces, pressures = thin_over_thick(WALLS), end_pressures(WALLS)
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
    for curve, colour, label in zip(forces, (BLUE, GREEN, VERMILION), ("28E", "32", "28 as printed"), strict=True):
        left.semilogx(WALLS, curve, color=colour, label=label)
    left.set(xlabel="wall / radius", ylabel="elastic force / that of the thick wall", ylim=(0, 1.35))
    for curve, colour, label in zip(
        pressures, ("black", SKY, VERMILION), ("thick wall (23T)", "23 corrected", "23 as printed"), strict=True
    ):
        right.semilogx(WALLS, curve, color=colour, label=label)
    right.set(xlabel="wall / radius", ylabel="pressure / (G h0)", ylim=(0.9, None))
    left.legend(fontsize=8)
    right.legend(fontsize=8)
    return figure


if __name__ == "__main__":
    app.run()
