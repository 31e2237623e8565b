"""Reading what came out of a test: votes to scores, recordings to physics."""
