"""Strict settings for every test: 64 bit, and a warning raised by our own code is an error."""

import jax

jax.config.update("jax_enable_x64", True)


def pytest_configure(config):
    config.addinivalue_line("filterwarnings", r"error:::(mckibben_jax|fitting)(\..*)?")
