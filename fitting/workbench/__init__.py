"""The workbench: a session, its data, its text, and the server."""
