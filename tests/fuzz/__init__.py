"""Every reader of what users give, fed with damaged files: a refusal in words or a result, and nothing else."""
