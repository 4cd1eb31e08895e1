"""Laws of the review and of the gas, as plain functions: they know muscles and states, and no effect."""
