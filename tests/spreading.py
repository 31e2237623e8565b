"""How the test files are spread over processes: whole, so that what they share is made once."""

from xdist.scheduler import LoadFileScheduling

TOGETHER = {
    "test_scene": "panoramas",  # the same kernels to compile, the same panoramas to render
    "test_clips_training": "panoramas",
    "test_specs.py": "panoramas",
    "test_demo": "panoramas",
    "test_session_browser": "screen",  # neither stalls the other
    "test_session_mpv": "screen",
}
"""Files, by the beginning of their names, that one process runs one after the other."""

LONG = ("row_banding", "smooth_prnu", "uneven_light", "edges", "greens", "own_sizes", "carry_over")
FIRST = (
    *TOGETHER,
    *(f"test_mismatch_{name}" for name in LONG),
    *("test_every_effect.py", "test_votes_survive", "test_startup", "test_workers_"),
)
"""Files that take long: begun early, none is left to one process at the end."""


def rank(file: str) -> int:
    """Return the place of a file in the order of work: what takes long, then the rest."""
    places = [place for place, name in enumerate(FIRST) if file.startswith(name)]
    return places[0] if places else len(FIRST)


class ByFile(LoadFileScheduling):
    """Gives each process a file, or the files that belong together, in the order collected."""

    def _split_scope(self, nodeid: str) -> str:
        file = super()._split_scope(nodeid).rpartition("/")[2]
        shared = [group for name, group in TOGETHER.items() if file.startswith(name)]
        return shared[0] if shared else file
