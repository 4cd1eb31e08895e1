"""The code and the style of the live picture, and the sum by which a browser knows the code for ours."""

import functools
from base64 import b64encode
from hashlib import sha256
from importlib import resources

FOLDER = resources.files("fitting.report.page.live")
OURS = ("decode", "canvas", "panes", "readout", "map", "picks", "fall", "keys", "runs", "start")


@functools.cache
def code() -> str:
    """All code as one script: uPlot with its licence, then our files, which share one scope of their own."""
    licence = _text("uplot/LICENSE").replace("*/", "")
    ours = "\n".join(_text(f"{name}.js") for name in OURS)
    return f'/* uPlot 1.6.32\n{licence}*/\n{_text("uplot/uPlot.iife.min.js")}\n(() => {{\n"use strict";\n{ours}}})();\n'


def style() -> str:
    """The style of the picture, with that of uPlot."""
    return _text("uplot/uPlot.min.css") + _text("live.css")


def allowed() -> str:
    """The only script that the page lets a browser run: ours, by its sum. Nothing from a file of data ever is."""
    return f"'sha256-{b64encode(sha256(code().encode()).digest()).decode()}'"


def skeleton() -> str:
    """The empty picture, hidden until the code fills it."""
    return _text("live.html")


def _text(name: str) -> str:
    return FOLDER.joinpath(name).read_text(encoding="utf-8")
