"""The hidden-effect benchmark: a plan fixed beforehand, its cases diagnosed, and the scores.

    python -m tests.hidden.study --share 0.1 --workers 2 --out hidden.jsonl --seed 1      # from the repository's root
    python -m tests.hidden.study --groups kinds,none --share 0.1    # a tenth of these groups of the plan only

`protocols` and `sizes` say what is hidden where and how large, `cases` lays out the plan, `judge` diagnoses one case,
`rivals` answers the same case as other tools would, `run` works through the plan, `scores`, `kinds` (recordings other
than loops at constant speeds), `rig_scores` (instruments that err, of which `erring` lays out the cases), `distance`
(printed detection limits over what an oracle detects) and `page` sum it up. `worth` says how often each verdict is
borne out, `likelier` how far likelihoods tell sets apart that stand.
"""
