"""Muscles, rubbers and places from which the tests of the equations draw."""

import numpy as np
from hypothesis import settings
from hypothesis import strategies as st

settings.register_profile("quick", max_examples=10, deadline=None, derandomize=True)
settings.load_profile("quick")

LENGTH = 0.3
angles = st.floats(np.radians(15), np.radians(40))
radii = st.floats(2e-3, 2e-2)
walls = st.floats(0.02, 0.4)
moduli = st.floats(3e4, 6e5)
cones = st.floats(0.05, 0.5)
nodes, weights = np.polynomial.legendre.leggauss(60)
