"""Pieces of design files: what is known of the muscle, the model, what varies, what is wanted, what limits it."""

KNOWN = """[muscle]
length = "300 mm"
shear_modulus = "0.54 MPa"
"""
WALL = 'wall_thickness = "1 mm"\n'
BREAKING = 'breaking_stress = "28 MPa"\n'
IDEAL = '[model]\neffects = ["ideal_cylinder"]\n'
RUBBER = '[model]\neffects = ["ideal_cylinder", "bladder_neo_hookean"]\n'
BRAID = """[variables]
braid_angle = ["12 deg", "40 deg"]
radius = ["4 mm", "12 mm"]
"""
FORCE = """[objective]
maximise = "force"
at = { contraction = 0.1, pressure = "5 bar" }
"""
MINIMUM = '[[constraint]]\nquantity = "minimum_pressure"\nmax = "1 bar"\n'
BURST = '[[constraint]]\nquantity = "burst_pressure"\nmin = "5 bar"\n'


def stroke(least):
    """A limit: so much stroke at least."""
    return f'[[constraint]]\nquantity = "stroke"\nat = {{ pressure = "5 bar" }}\nmin = "{least}"\n'
