import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium")

with app.setup(hide_code=True):
    import marimo as mo
    import matplotlib.pyplot as plt
    import numpy as np

    from fitting import use_64_bit
    from fitting.report import BLUE, GREEN, GREY, ORANGE, VERMILION
    from mckibben_jax.laws import braid, rubber, working_pressure

    use_64_bit()

    BAR, A20, A30 = 1e5, np.radians(20), np.radians(30)
    ANGLES = {"20 deg": A20, "30 deg": A30}
    SOFT, HARD = 0.54e6, 1.37e6  # Pa, shear modulus of rubbers of 45 and 65 IRHD
    BREAKS, MISPRINTED = 28e6, 280e6  # Pa, breaking stress of the soft one, and as the review has it
    RADIUS = 0.01  # m, of figure 12


@app.cell
def _(answer):
    if not mo.running_in_notebook():
        print(answer)
    mo.md(f"# Between which pressures can a McKibben muscle work?\n\n{answer}")
    return


@app.cell
def _():
    answer = sentence()
    return (answer,)


@app.cell
def _():
    mo.md("""
    ## Figure 7: force without friction, with a wall

    Dotted, the review's "real" cylinder (18) with walls of 0.05, 0.1 and 0.15 of the radius: it takes the wall to carry
    nothing. A wall that carries what rubber must leaves the ideal law at the outer radius (10), whatever its thickness;
    what the wall's own stiffness takes away comes in figure 12.
    """)
    return


@app.cell
def _():
    figure_7()
    return


@app.cell
def _():
    mo.md("""
    ## Figure 8: ballooning, and the pressure that fills the braid

    Left, a tube without braid: free to lengthen it balloons at the dot; held at its length it does not. Right, under a
    braid: thick wall (lines), thin wall with 23 corrected (dashes), 23 as printed (dots), wall 0.1 of the radius.
    """)
    return


@app.cell
def _():
    figure_8()
    return


@app.cell
def _():
    mo.md("""
    ## Figure 9: burst pressure

    With the breaking stress of 28 MPa; the printed 280 MPa would put every curve ten times higher. It lets the rubber
    alone carry the pressure, though the braid takes most of it: cautious.
    """)
    return


@app.cell
def _():
    figure_9()
    return


@app.cell
def _():
    mo.md("""
    ## Figure 11: conical ends

    The same cones by the printed virtual work (25, dots; drawn until the cones meet) and by their volume (25E, lines).
    """)
    return


@app.cell
def _():
    figure_11()
    return


@app.cell
def _():
    mo.md("""
    ## Figure 12: what the rubber takes away

    20 deg, radius 1 cm, soft rubber, walls of 0.5, 1 and 1.5 mm: thick wall by its energy (lines), thin wall by its
    energy (28E, dashes), and the printed axial force (28, dots).
    """)
    return


@app.cell
def _():
    figure_12()
    return


@app.cell
def _():
    mo.md("""
    ## Figure 13: contact surface of the strands

    As printed (35), which is right: least where the braid angle is 45 deg.
    """)
    return


@app.cell
def _():
    figure_13()
    return


@app.function
def fills(angle, wall_ratio, modulus):
    """Pressure that presses the tube against the braid to the end of the stroke, bar: thick wall, 23 corrected, printed."""
    end = braid.largest_contraction(angle)
    found = (
        working_pressure.minimum_pressure(end, angle, wall_ratio, modulus / 2, 0.0),
        working_pressure.minimum_pressure_thin(end, angle, wall_ratio, modulus),
        working_pressure.minimum_pressure_thin_printed(end, angle, wall_ratio, modulus),
    )
    return tuple(float(pressure / BAR) for pressure in found)


@app.function
def bursts(angle, wall_ratio, stress=BREAKS):
    """Least burst pressure over the stroke, bar."""
    end = braid.largest_contraction(angle)
    return float(working_pressure.burst_pressure(end, angle, wall_ratio, stress) / BAR)


@app.function
def balloons(wall_ratio, modulus):
    """Pressure at which a free tube balloons, bar, and its circumferential stretch there."""
    stretch = working_pressure.ballooning_stretch()
    return float(working_pressure.free_tube_pressure(stretch, wall_ratio, modulus) / BAR), float(stretch)


@app.function
def faults():
    """How far the printed curves of figures 7, 11 and 12 are from the right ones."""
    ideal = float(braid.ideal_force(0.0, 1.0, 1.0, A20))
    cylinder, printed, sound = (
        float(force) / ideal
        for force in (
            braid.ideal_force(0.2, 1.0, 1.0, A20),
            braid.cone_force_printed(0.2, 1.0, 1.0, A20, 0.5),
            braid.cone_force(0.2, 1.0, 1.0, A20, 0.5),
        )
    )
    return {
        "wall": float(100 * (braid.real_force_thin_printed(0.0, 1.0, 1.0, A20, 0.1) / ideal - 1)),
        "printed cones": 100 * (printed - cylinder),
        "sound cones": 100 * (sound - cylinder),
        "printed rubber": float(rubber.axial_elastic_force_printed(0.1, RADIUS, A20, 0.1, SOFT)),
        "rubber": float(rubber.thick_elastic_force(0.1, RADIUS, A20, 0.1, SOFT / 2, 0.0)),
    }


@app.function
def sentence():
    """The answer, every number computed."""
    thick, corrected, printed = fills(A20, 0.1, SOFT)
    least, stretch = balloons(0.1, SOFT)
    off = faults()
    high, thin = bursts(A20, 0.1), bursts(A20, 0.07)
    return f"""
With a wall of 0.1 of the radius, soft rubber (45 IRHD) and 20 deg, **from {thick:.2f} bar**, where the tube fills the
braid over the whole stroke, **to {high:.1f} bar**, where it may burst; at 30 deg from {fills(A30, 0.1, SOFT)[0]:.2f} to
{bursts(A30, 0.1):.1f} bar. Rubber of 65 IRHD asks for {fills(A20, 0.1, HARD)[0]:.2f} and
{fills(A30, 0.1, HARD)[0]:.2f} bar.

- To fill the braid: thin walls, 23 corrected, ask for {corrected:.2f} bar, 23 as printed {printed:.2f}; the text reads
  1.0 from its figure 8. Without a braid the same tube balloons at {least:.2f} bar, stretched {stretch:.3f} times.
- To burst: a wall of 0.07 bears {thin:.2f} bar ("just above 5"), which needs 28 MPa; the printed 280 MPa would give
  {bursts(A20, 0.07, MISPRINTED):.0f} bar.
- Figure 7: the printed wall costs {-off["wall"]:.1f} % of the force at rest (20 deg, 0.1), the right one nothing.
- Figure 11: at a contraction of 0.2 printed cones (k_c = 0.5) add {off["printed cones"]:.0f} % of the force at rest; by
  their volume they take {-off["sound cones"]:.0f} %.
- Figure 12: at a contraction of 0.1 the printed rubber takes {-off["printed rubber"]:.1f} N, a 1 mm wall by its energy
  {-off["rubber"]:.0f} N.
- Figure 13 is right: the contact surface is least at {float(braid.contraction_at_45_degrees(A20)):.3f} and
  {float(braid.contraction_at_45_degrees(A30)):.3f}.
"""


@app.function
def panels(columns, **options):
    """A row of axes."""
    return plt.subplots(1, columns, figsize=(4.6 * columns, 3.4), layout="constrained", squeeze=False, **options)


@app.function
def figure_7():
    """Ideal and "real" force over section times pressure."""
    figure, [(axes,)] = panels(1)
    for (name, angle), colour in zip(ANGLES.items(), (BLUE, VERMILION), strict=True):
        eps = np.linspace(0, float(braid.largest_contraction(angle)), 100)
        axes.plot(eps, braid.ideal_force(eps, 1.0, 1.0, angle) / np.pi, color=colour, label=f"{name}, (10)")
        for wall in (0.05, 0.1, 0.15):
            bore = rubber.inner_radius(eps, 1.0, angle, wall)
            printed = braid.real_force_printed(eps, 1.0, 1.0, angle, bore) / np.pi
            axes.plot(eps, printed, ":", color=colour, label="printed (18)" if wall == 0.1 else None)
    axes.set(xlabel="contraction", ylabel="force / (section x pressure)", ylim=(0, None))
    axes.legend(fontsize=8)
    return figure


@app.function
def figure_8():
    """Pressure over stretch without braid, and over the radius under it."""
    figure, [(left, right)] = panels(2)
    stretch = np.linspace(1, 4, 150)
    for law, colour, label in (
        (working_pressure.free_tube_pressure, VERMILION, "free"),
        (working_pressure.held_tube_pressure, BLUE, "held at its length"),
    ):
        left.plot(stretch, law(stretch, 0.5, 1.0), color=colour, label=label)
    top = working_pressure.ballooning_stretch()
    left.plot(top, working_pressure.free_tube_pressure(top, 0.5, 1.0), "o", color=VERMILION)
    left.set(xlabel="stretch of the circumference", ylabel="P (1 - h0) / (G h0)", ylim=(0, 1.05))
    left.legend(fontsize=8)
    for (name, angle), colours in zip(ANGLES.items(), ((BLUE, GREEN), (VERMILION, ORANGE)), strict=True):
        eps = np.linspace(0, float(braid.largest_contraction(angle)), 100)
        wide = braid.radius_ratio(eps, angle)
        for (rubber_name, modulus), colour in zip((("45", SOFT), ("65", HARD)), colours, strict=True):
            thick = working_pressure.minimum_pressure(eps, angle, 0.1, modulus / 2, 0.0)
            right.plot(wide, thick / BAR, color=colour, label=f"{name}, {rubber_name} IRHD")
            thin = working_pressure.minimum_pressure_thin(eps, angle, 0.1, modulus)
            right.plot(wide, thin / BAR, "--", color=colour, linewidth=1)
            printed = working_pressure.minimum_pressure_thin_printed(eps, angle, 0.1, modulus)
            right.plot(wide, printed / BAR, ":", color=colour)
    right.set(xlabel="radius / radius at rest", ylabel="pressure to fill the braid [bar]")
    right.legend(fontsize=8)
    return figure


@app.function
def figure_9():
    """Burst pressure over contraction."""
    figure, axes = panels(2, sharey=True)
    for panel, (name, angle) in zip(axes[0], ANGLES.items(), strict=True):
        eps = np.linspace(0, float(braid.largest_contraction(angle)), 100)
        for wall, colour in zip((0.07, 0.1, 0.15), (VERMILION, ORANGE, BLUE), strict=True):
            pressure = working_pressure.burst_pressure(eps, angle, wall, BREAKS) / BAR
            panel.plot(eps, pressure, color=colour, label=f"wall {wall} of the radius")
        panel.axhline(5, color=GREY, linewidth=0.8)
        panel.set(title=name, xlabel="contraction", ylim=(0, 55))
    axes[0][0].set_ylabel("burst pressure [bar]; grey: 5 bar in use")
    axes[0][1].legend(fontsize=8)
    return figure


@app.function
def figure_11():
    """Force with conical ends over section times pressure."""
    figure, axes = panels(2)
    for panel, (name, angle), ratios in zip(axes[0], ANGLES.items(), ((0.5, 0.75), (0.5, 0.75, 1.0)), strict=True):
        eps = np.linspace(0, 0.5, 120)
        panel.plot(eps, braid.ideal_force(eps, 1.0, 1.0, angle) / np.pi, color=GREY, linewidth=2, label="cylinder (10)")
        for ratio, colour in zip(ratios, (BLUE, VERMILION, GREEN), strict=False):
            open_ends = eps[eps <= 1 / (1 + 2 * ratio)]
            sound = braid.cone_force(open_ends, 1.0, 1.0, angle, ratio) / np.pi
            panel.plot(open_ends, sound, color=colour, label=f"k_c = {ratio}")
            printed = braid.cone_force_printed(open_ends, 1.0, 1.0, angle, ratio) / np.pi
            panel.plot(open_ends, printed, ":", color=colour)
        panel.axhline(0, color=GREY, linewidth=0.6)
        panel.set(title=name, xlabel="contraction", ylim=(-0.15 * panel.get_ylim()[1], None))
        panel.legend(fontsize=8)
    axes[0][0].set_ylabel("force / (section x pressure)")
    return figure


@app.function
def figure_12():
    """What the wall takes from the pull, over contraction."""
    figure, [(axes,)] = panels(1)
    eps = np.linspace(0, float(braid.largest_contraction(A20)), 100)
    for wall, colour in zip((0.05, 0.1, 0.15), (BLUE, ORANGE, VERMILION), strict=True):
        thick = rubber.thick_elastic_force(eps, RADIUS, A20, wall, SOFT / 2, 0.0)
        axes.plot(eps, -thick, color=colour, label=f"wall {1e3 * wall * RADIUS:.1f} mm")
        axes.plot(eps, -rubber.thin_elastic_force(eps, RADIUS, A20, wall, SOFT), "--", color=colour, linewidth=1)
        axes.plot(eps, -rubber.axial_elastic_force_printed(eps, RADIUS, A20, wall, SOFT), ":", color=colour)
    axes.set(xlabel="contraction", ylabel="force taken by the rubber [N]")
    axes.legend(fontsize=8)
    return figure


@app.function
def figure_13():
    """Contact surface over that at rest."""
    figure, [(axes,)] = panels(1)
    for (name, angle), colour in zip(ANGLES.items(), (BLUE, VERMILION), strict=True):
        eps = np.linspace(0, float(braid.largest_contraction(angle)), 100)
        surface = braid.contact_surface(eps, 1.0, 1.0, angle) / (2 * np.pi)
        axes.plot(eps, surface, color=colour, label=name)
        least = float(braid.contraction_at_45_degrees(angle))
        axes.plot(least, braid.contact_surface(least, 1.0, 1.0, angle) / (2 * np.pi), "o", color=colour)
    axes.set(xlabel="contraction", ylabel="contact surface / that at rest", ylim=(0, None))
    axes.legend(fontsize=8)
    return figure


if __name__ == "__main__":
    app.run()
