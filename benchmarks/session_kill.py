"""Kill the session's server with `kill -9` at 200 random moments while votes arrive.

Every vote that was acknowledged must be in the store, once; the store must be sound after each
kill; the resumed session must end with a complete plan. `tests/test_votes_survive_a_kill.py` does
the same with 20 kills, and holds what is done here.
"""

import argparse
import importlib.util
import tempfile
import time
from pathlib import Path

TEST = Path(__file__).resolve().parents[1] / "tests" / "test_votes_survive_a_kill.py"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    spec = importlib.util.spec_from_file_location("kills", TEST)
    test = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(test)
    planned = options.kills * test.VOTES_PER_LIFE + 10
    began = time.monotonic()

    def tell(kill):
        if kill % 20 == 0:
            print(f"{kill} kills, {time.monotonic() - began:.0f} s", flush=True)

    with tempfile.TemporaryDirectory() as folder:
        votes = test.kill_servers(Path(folder), options.kills, planned, options.seed, tell)
        test.check_after_kills(Path(folder), votes, options.kills, planned)
    lost = planned - len(votes)
    print(f"{options.kills} kills: {len(votes)} acknowledged votes, each there once, of {planned}")
    print(
        f"{lost} votes were on disk before their acknowledgement got through (at most one a kill)"
    )


if __name__ == "__main__":
    main()
