"""Scripts to copy: each does one job of an analysis with the public functions of `analysis`.

Run one as `python -m analysis.scripts.mos_report votes/votes.csv`, or copy it and change it.
"""
