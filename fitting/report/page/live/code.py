"""The code and the style of the live picture, and the sum by which a browser knows the code for ours."""

import functools
import json
from base64 import b64encode
from hashlib import sha256
from importlib import resources

FOLDER = resources.files("fitting.report.page.live")
# of both; then the page or the workbench
OURS = ("decode", "canvas", "panes", "readout", "map", "picks", "fall", "candidates", "keys", "runs", "start")


@functools.cache
def code() -> str:
    """All code as one script: uPlot with its licence, then our files, which share one scope of their own."""
    return f'{_uplot()}(() => {{\n"use strict";\n{_ours()}{_text("page.js")}}})();\n'


@functools.cache
def widget_code() -> str:
    """The same as a module that draws into the element of a widget."""
    return f"{_uplot()}{_ours()}const SKELETON = {json.dumps(skeleton())};\n{_text('widget.js')}"


def _uplot() -> str:
    return f"/* uPlot 1.6.32\n{_text('uplot/LICENSE').replace('*/', '')}*/\n{_text('uplot/uPlot.iife.min.js')}\n"


def _ours() -> str:
    return "\n".join(_text(f"{name}.js") for name in OURS)


def style() -> str:
    """The style of the picture, with that of uPlot."""
    return _text("uplot/uPlot.min.css") + _text("live.css")


def allowed() -> str:
    """The only script that the page lets a browser run: ours, by its sum. Nothing from a file of data ever is."""
    return f"'sha256-{b64encode(sha256(code().encode()).digest()).decode()}'"


def widget_style() -> str:
    """The style of a widget, which no style of the page around it reaches."""
    return style() + _text("widget.css")


def skeleton() -> str:
    """The empty picture, hidden until the code fills it."""
    return _text("live.html")


def _text(name: str) -> str:
    return FOLDER.joinpath(name).read_text(encoding="utf-8")
