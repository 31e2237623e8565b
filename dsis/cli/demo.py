"""`dsis demo`: the whole chain in small."""

import argparse
import shutil
from pathlib import Path

from dsis.cli.arguments import Add, add_jobs, add_seed, whole
from dsis.cli.progress import progress_bar
from dsis.cli.report import mos_table

DEMO_SPEC = "demo.toml"
DEMO_OBSERVERS = 18


def add_demo(add: Add) -> None:
    """Say what `dsis demo` takes."""
    sub = add(
        "demo",
        demo,
        "The whole chain in small: stimuli, a session of simulated observers, the MOS report.",
        "demo --out my-demo",
    )
    sub.add_argument("--out", type=Path, default=Path("dsis-demo"), metavar="DIR")
    sub.add_argument("--observers", type=whole(1), default=DEMO_OBSERVERS, metavar="N")
    add_jobs(sub)
    add_seed(sub, "default: the spec's")


def demo(options: argparse.Namespace) -> None:
    """Run the whole chain in small."""
    from analysis.report import write_report
    from dsis.outdir import result_folder
    from dsis.session import export_votes, run_robots
    from dsis.session.store import voted_people
    from dsis.spec import SHIPPED, read_spec
    from dsis.stimuli import build_digest, build_stimuli, summary

    out: Path = options.out
    test = read_spec(SHIPPED / DEMO_SPEC, seed=options.seed)

    def people(folder: Path) -> str | None:
        found = voted_people(folder / "stimuli")
        return f"votes of {', '.join(found)}" if found else None

    with result_folder(
        out, "report/report.html", keep=people, resume=f"demo {build_digest(test)}"
    ) as folder:
        stimuli_dir = folder / "stimuli"
        for made_again in (stimuli_dir / "session", folder / "votes", folder / "report"):
            shutil.rmtree(made_again, ignore_errors=True)
        print(f"1/3 stimuli: {test.spec.title}, four noise conditions")
        with progress_bar("stimuli") as progress:
            manifest = build_stimuli(test, stimuli_dir, jobs=options.jobs, progress=progress)
        print(summary(manifest))
        print(f"2/3 session: {options.observers} SIMULATED observers (robots) vote")
        run_robots(stimuli_dir, options.observers, seed=test.spec.seed)
        export_votes(stimuli_dir, folder / "votes")
        print("3/3 report")
        write_report(folder / "votes" / "votes.csv", folder / "report")
    print(mos_table(out / "report" / "mos.csv"))
    print("All votes are SIMULATED: they show the tool at work, not what people see.")
    print(f"report   {out / 'report' / 'report.html'}")
    print(f"stimuli  {out / 'stimuli'} (pictures in figures/)")
    print(f"vote     dsis session {out / 'stimuli'} --observer YOUR-NAME")
