"""The paper recomputed: every table, figure and claim beside its published number."""

from analysis.paper.parts import PARTS, write_paper
from analysis.paper.setting import Setting, kodak_images, real_recording

__all__ = ["PARTS", "Setting", "kodak_images", "real_recording", "write_paper"]
