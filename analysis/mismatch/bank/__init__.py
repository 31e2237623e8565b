"""Numbers that say how a recording differs: of single exposures, and of sums over exposures."""
