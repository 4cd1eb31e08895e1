"""Do intervals hold the truth as often as they say? Data sets drawn from the prior, and the truth's rank in each.

    python -m tests.calibration --cases 200 --workers 2 --out tests/calibration/results/DATE.jsonl

`truths` draws muscles from the prior and lets the independent simulator measure them, `cases` asks the program what it
knows of each, `page` counts. Where an effect is left out on purpose, the question is whether the program warns.
"""
