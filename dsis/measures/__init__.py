"""Statistics of recordings that effects contribute to and diagnosis compares."""

from dsis.measures.variance_components import MEASURES, Estimate, measure

__all__ = ["MEASURES", "Estimate", "measure"]
