"""model.toml: one reader and one writer."""
