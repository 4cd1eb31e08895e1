"""From files to checked readings: tables, units, branches, loops, and what a user defines."""
