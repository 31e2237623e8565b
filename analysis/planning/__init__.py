"""How many observers a test needs: from a difference and a spread, or from votes of a pilot."""

from analysis.planning.pilot import POWER_COLUMNS, power_from_pilot
from analysis.planning.samplesize import Plan, observers_needed, power_of

__all__ = ["POWER_COLUMNS", "Plan", "observers_needed", "power_from_pilot", "power_of"]
