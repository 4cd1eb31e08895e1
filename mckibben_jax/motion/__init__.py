"""Muscles that move a load: releases, steps of pressure, and slow sweeps under a hung load."""
