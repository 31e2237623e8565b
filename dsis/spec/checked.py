"""A test spec with everything that it refers to."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from dsis.camera import Camera
from dsis.spec.footage import Footage, footage_of
from dsis.spec.schema import Content, Spec


@dataclass(frozen=True)
class Test:
    """A test spec with everything that it refers to, checked.

    Attributes
    ----------
    spec
        The spec; paths in it count from `folder`.
    camera
        The camera model it names.
    folder
        Folder that holds the spec.
    footage
        Files of every content that has any, by the content's name; stills are one content each.
    sigma
        White noise in 8-bit codes that a manifest has solved, by content and level; else empty.
    """

    __test__ = False  # no test case, whatever the name says to a test runner

    spec: Spec
    camera: Camera
    folder: Path
    footage: Mapping[str, Footage]
    sigma: Mapping[tuple[str, int], float]

    def contents(self) -> tuple[Content, ...]:
        """Return the contents, each still on its own."""
        found: list[Content] = []
        for content in self.spec.content:
            if content.stills is None:
                found.append(content)
            else:
                stills = footage_of(content, self.folder)
                found += [content.model_copy(update={"name": still.name}) for still in stills]
        return tuple(found)
