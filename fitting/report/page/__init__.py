"""What was found, as HTML pages that open from disk."""
