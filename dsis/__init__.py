"""Prepare, run and analyse double-stimulus impairment tests of real camera noise."""

__version__ = "0.1.0"
