"""Effects by name: the library, a user's Python file, and effects written in one line."""
