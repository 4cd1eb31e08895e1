"""How many readings of new runs does the band of 90 % hold? With the right model, and with models wrong on purpose.

    python -m tests.new_runs --cases 100 --out tests/new_runs/results/DATE.jsonl

`sessions` lets the independent simulator record one muscle in runs of random pressure, speed and stroke, with
instruments that err; `cases` fits some of the runs and counts in the band the readings of the others; `page` adds up.
"""
