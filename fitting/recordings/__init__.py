"""From files to checked readings in SI units: tables, units, runs, branches, noise, and which samples carry weight."""
