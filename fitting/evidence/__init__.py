"""Evidence that grows from session to session, and holds wherever one stops."""
