"""What the symbols of the review's equations mean, so that each equation can be read by itself."""

import re

_NAME = r"[A-Za-z][A-Za-z_0-9]*(?:'_\w+|'*)"
_SYMBOL = re.compile(_NAME)
_DEFINED = re.compile(r"(?:^|, )([A-Za-z][A-Za-z_0-9]*) = ")  # what a formula itself says
_SAID = re.compile(rf"(?:^|[,;] |and )({_NAME})(?=[ ,*])")  # with what each part of a text begins
# functions, differentials, indices and words
_NO_SYMBOLS = frozenset(
    ("sin", "cos", "tan", "atan", "sqrt", "ln", "exp", "sign", "int", "sum", "pi", "d", "dr", "dl", "dV", "dE", "dt",
     "dR", "deps", "i", "j", "of", "at", "rayon", "iron", "cycles")
)  # fmt: skip

MEANINGS = {
    "F": "pull of the muscle",
    "P": "gauge pressure",
    "V": "volume",
    "r": "present radius",
    "r0": "radius at rest",
    "l": "present length",
    "l0": "length at rest",
    "eps": "contraction (l0 - l)/l0",
    "eps_max": "contraction at which the pull ends",
    "F_max": "largest pull",
    "F10": "pull by equation 10",
    "f'": "slope of f",
    "alpha": "present braid angle from the axis",
    "alpha0": "braid angle at rest",
    "B": "length of a cord",
    "N": "turns of a cord",
    "h0": "wall ratio t0/r0",
    "t0": "thickness of the wall at rest",
    "r_i": "present radius of the bore",
    "r_i0": "radius of the bore at rest",
    "G": "shear modulus",
    "C10": "first constant of Mooney and Rivlin",
    "C01": "second constant of Mooney and Rivlin",
    "C_ij": "constants of Rivlin",
    "I1": "first invariant of the strain",
    "I2": "second invariant of the strain",
    "W": "energy of a volume of rubber",
    "E": "energy of the rubber",
    "lambda1": "stretch r_i/r_i0 around",
    "lambda2": "stretch l/l0 along",
    "lambda_theta": "stretch around",
    "lz": "stretch along",
    "l1": "stretch around",
    "l2": "stretch along",
    "l3": "stretch through the wall",
    "s1": "stress around",
    "s2": "stress along",
    "s3": "stress through the wall",
    "s_z": "stress along",
    "P_min": "pressure of equation 23",
    "S": "contact surface of the strands",
    "S_scale": "scale factor of equation 38",
    "F_c": "force of a crossing",
    "r_c": "radius of the contact",
    "x": "shortening",
    "x'": "speed of shortening",
    "x''": "acceleration of shortening",
    "M": "moved mass",
    "g": "gravity",
    "V_max": "speed without load",
    "F_V": "viscous force",
}


def symbols_in(formula: str) -> tuple[str, ...]:
    """The symbols of a formula in their order, each once."""
    return tuple(dict.fromkeys(symbol for symbol in _SYMBOL.findall(formula) if symbol not in _NO_SYMBOLS))


def undefined(formula: str, own: str) -> tuple[str, ...]:
    """The symbols whose meaning neither the formula, nor a text of `own` meanings, nor the glossary says."""
    known = {*_SAID.findall(own), *_DEFINED.findall(formula), *MEANINGS}
    return tuple(symbol for symbol in symbols_in(formula) if symbol not in known)


def meanings(formula: str, own: str) -> str:
    """What the symbols of a formula mean: `own` meanings first, then those of the glossary."""
    said = _SAID.findall(own)
    common = [f"{name} {MEANINGS[name]}" for name in symbols_in(formula) if name in MEANINGS and name not in said]
    return ", ".join(filter(None, (own, *common)))
