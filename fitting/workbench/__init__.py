"""The workbench: a session, its data, its words, and the server."""
