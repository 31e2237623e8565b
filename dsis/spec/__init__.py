"""A test spec: one TOML file = one subjective test (`dsis-test/1`)."""

from dsis.spec.checked import Test
from dsis.spec.footage import Footage
from dsis.spec.reading import SHIPPED, read_spec, spec_path
from dsis.spec.schema import SOLVED_SIGMA_MAX, TRAINING, Content, Sequence, Session, Spec

__all__ = [
    "SHIPPED",
    "SOLVED_SIGMA_MAX",
    "TRAINING",
    "Content",
    "Footage",
    "Sequence",
    "Session",
    "Spec",
    "Test",
    "read_spec",
    "spec_path",
]
