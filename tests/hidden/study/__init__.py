"""The hidden-effect benchmark: a plan fixed beforehand, its cases diagnosed, and the scores.

    python -m tests.hidden.study --share 0.1 --workers 2 --out hidden.jsonl --seed 1      # from the repository's root

`protocols` and `sizes` say what is hidden where and how large, `cases` lays out the plan, `judge` diagnoses one case,
`rivals` answers the same case as other tools would, `run` works through the plan, `scores` and `page` sum it up.
"""
