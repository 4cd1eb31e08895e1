"""Words, pages and pictures that several commands share."""
