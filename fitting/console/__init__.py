"""What the commands share: arguments, options, the model to begin with, where results go."""
