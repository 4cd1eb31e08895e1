"""Pictures: figures of matplotlib, and pictures that are HTML."""
