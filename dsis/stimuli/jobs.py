"""What a test shows: its contents in all conditions, and the training's."""

from dataclasses import dataclass

import numpy as np

from dsis.scenes import SCENES
from dsis.spec import TRAINING, Content, Test
from dsis.spec.schema import SEED_MAX
from dsis.stimuli.conditions import Condition, conditions_of

_TRAINING_SEED_STEP = 1_000_003


@dataclass(frozen=True)
class Job:
    """A content with the conditions that it is shown in."""

    content: Content
    role: str
    conditions: tuple[Condition, ...]

    @property
    def name(self) -> str:
        """Name of the content."""
        return self.content.name or ""

    @property
    def reference(self) -> str:
        """Name of the content's reference stimulus."""
        return f"{self.name}__reference"


def jobs_of(test: Test) -> tuple[Job, ...]:
    """Return what is to be built: the test's contents in all conditions, and the training's.

    Training shows another scene, or the same with another seed: never a clip of the test.
    """
    conditions = conditions_of(test.spec)
    jobs = [Job(content, "test", conditions) for content in test.contents()]
    wanted = min(test.spec.session.training, len(conditions))
    if wanted:
        places = np.linspace(0, len(conditions) - 1, wanted).round().astype(int)
        jobs.append(Job(training_content(test), TRAINING, tuple(conditions[i] for i in places)))
    return tuple(jobs)


def training_content(test: Test) -> Content:
    """Return the content of the training: a scene that the test does not show."""
    shown = [content for content in test.spec.content if content.scene is not None]
    unused = [scene for scene in SCENES if scene not in {c.scene for c in shown}]
    model = shown[0] if shown else Content(name=TRAINING, scene=SCENES[0])
    scene = unused[0] if unused else model.scene
    seed = max((c.scene_seed for c in shown), default=0) + _TRAINING_SEED_STEP
    seed %= SEED_MAX + 1
    return model.model_copy(update={"name": TRAINING, "scene": scene, "scene_seed": seed})
