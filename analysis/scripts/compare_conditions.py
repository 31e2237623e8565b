"""The paper's question in sentences: whether demosaicking lowers the MOS, where, by how much."""

import sys
from pathlib import Path

import analysis

SCALE = (1, 10)


def main(file: Path) -> None:
    """Print the paired contrasts in words, and beside them the ordinal model's effect sizes."""
    votes = analysis.read_votes(file, SCALE)
    contrasts = analysis.test_contrasts(votes)
    for sentence in analysis.conclusions(contrasts):
        sys.stdout.write(f"{sentence}\n")
    probit = analysis.ordinal_contrasts(votes, "probit")
    averages = probit.contrasts[probit.contrasts["grain"] != "cell"]
    columns = ["treatment", "content", "effect_size", "superiority"]
    sys.stdout.write(f"{averages[columns].round(2).to_string(index=False)}\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
