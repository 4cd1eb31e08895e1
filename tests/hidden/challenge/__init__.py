"""Challenge kit: seal recordings of any simulator, run any program on them, score its answers. See README.md."""
