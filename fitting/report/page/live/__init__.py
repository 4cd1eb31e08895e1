"""The live picture of the page: measured and model under the pointer, and the fall of the error from model to model.

The files of JavaScript stand here as they are; `code` joins them, `payload` writes what they draw.
"""
