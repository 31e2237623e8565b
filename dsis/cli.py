"""The command line: parse, call one function, print. The one file that knows both packages."""

import argparse
import errno
import math
import os
import shutil
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from dsis import __version__
from dsis.errors import DsisError, InputError

if TYPE_CHECKING:
    from dsis.session.player import Player

DEMO_SPEC = "demo.toml"
DEMO_OBSERVERS = 18


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status: 0 done, 1 damaged files, 2 bad input."""
    options = _parser().parse_args(arguments)
    try:
        options.command(options)
    except DsisError as error:
        _complain(str(error))
        return 2 if isinstance(error, InputError) else 1
    except KeyboardInterrupt:
        _complain("interrupted")
        return 130
    except BrokenPipeError:
        # Whoever read the output has gone (`| head`); nothing is left to say.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except OSError as error:
        place = f"{error.filename}: " if error.filename else ""
        _complain(f"{place}{error.strerror or error}")
        return 1 if error.errno in (errno.ENOSPC, errno.EIO) else 2
    return 0


def _complain(message: str) -> None:
    print("\n".join(f"dsis: {line}" for line in message.splitlines()), file=sys.stderr)


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
        with _progress("stimuli") as progress:
            manifest = build_stimuli(test, stimuli_dir, jobs=options.jobs, progress=progress)
        print(summary(manifest))
        print(f"2/3 session: {options.observers} SIMULATED observers (robots) vote")
        run_robots(stimuli_dir, options.observers, seed=test.spec.seed)
        export_votes(stimuli_dir, folder / "votes")
        print("3/3 report")
        write_report(folder / "votes" / "votes.csv", folder / "report")
    print(_mos_table(out / "report" / "mos.csv"))
    print("All votes are SIMULATED: they show the tool at work, not what people see.")
    print(f"report   {out / 'report' / 'report.html'}")
    print(f"stimuli  {out / 'stimuli'} (pictures in figures/)")
    print(f"vote     dsis session {out / 'stimuli'} --observer YOUR-NAME")


def _mos_table(path: Path) -> str:
    import pandas as pd

    scores = pd.read_csv(path)
    columns = ["stimulus", "n", "mos", "ci_low", "ci_high", "n_removed", "mos_trimmed"]
    return str(scores[columns].round(2).to_string(index=False))


def stimuli(options: argparse.Namespace) -> None:
    """Build, check or estimate the stimuli of a test."""
    from dsis.spec import read_spec
    from dsis.stimuli import build_stimuli, check_stimuli, estimate, summary

    if options.check is not None:
        with _progress("check") as progress:
            frames = check_stimuli(options.check, jobs=options.jobs, progress=progress)
        print(f"{frames} frames agree with {options.check / 'manifest.json'}")
        return
    if options.spec is None:
        fact = "SPEC.toml is missing (or give --check DIR)"
        raise InputError.of(fact, "", "")
    test = read_spec(options.spec, options.source, options.seed)
    out = options.out or Path(f"{Path(options.spec).stem}-stimuli")
    if options.dry_run:
        print(estimate(test, out, options.jobs))
        return
    with _progress("stimuli") as progress:
        manifest = build_stimuli(
            test, out, jobs=options.jobs, scheduler=options.scheduler, progress=progress
        )
    print(summary(manifest))
    print(f"{len(manifest.clips)} clips in {out}")


def session(options: argparse.Namespace) -> None:
    """Run a session with people or robots, plan it, or say how far it is."""
    from dsis import session as sessions
    from dsis.manifest import read_manifest

    folder: Path = options.stimuli_dir
    seed = 1 if options.seed is None else options.seed
    setup = None
    if options.setup is not None:
        setup = sessions.read_setup(options.setup, read_manifest(folder).session.scale)
    if options.status:
        print(sessions.status(folder))
    elif options.plan:
        print(sessions.plan_panel(folder, options.observer, seed=seed, setup=setup))
    elif options.sheets is not None:
        people = sessions.write_sheets(folder, options.sheets)
        print(f"score sheets and plans of {people} observers in {options.sheets}")
    elif options.typed is not None:
        stored, blank = sessions.read_typed_votes(folder, options.typed)
        print(f"{stored} votes stored, {blank} left blank")
    elif options.forget is not None:
        sessions.forget(folder, options.forget)
        print(f"personal data of {options.forget} erased; the votes stay")
    elif options.robots is not None:
        sessions.run_robots(folder, options.robots, seed=seed, setup=setup)
        print(f"{options.robots} SIMULATED observers voted; export: dsis votes {folder} -o DIR")
    elif options.observer is None:
        fact = "give --observer ID, --plan, --robots N, --sheets DIR, --typed FILE or --status"
        raise InputError.of(fact, "", "")
    else:
        sessions.serve(
            folder,
            options.observer,
            port=options.port,
            open_browser=not options.no_browser,
            resume=options.resume,
            seed=seed,
            setup=setup,
            player=_player(options, folder),
        )


def _player(options: argparse.Namespace, folder: Path) -> "Player | None":
    """Return the program that shows the clips; None: the page does."""
    if options.player == "page":
        return None
    from dsis.manifest import read_manifest
    from dsis.session.mpv import MpvPlayer

    return MpvPlayer(
        read_manifest(folder).sequence, screen=options.screen, output=options.video_output
    )


def votes(options: argparse.Namespace) -> None:
    """Export the recorded votes."""
    from dsis.session import export_votes

    export_votes(options.stimuli_dir, options.out, personal=options.personal)
    print(f"votes in {options.out / 'votes.csv'}; report: dsis report {options.out / 'votes.csv'}")


def report(options: argparse.Namespace) -> None:
    """Write the MOS report."""
    from analysis.rejection import read_accepted
    from analysis.report import write_report

    first: Path = options.votes[0]
    out = options.out or first.with_name(f"{first.stem}-report")
    accepted = [] if options.accept is None else read_accepted(options.accept)
    write_report(
        options.votes,
        out,
        tuple(options.scale) if options.scale else None,
        rejected=options.reject,
        accepted=accepted,
        threshold=options.threshold,
        passes=options.passes,
    )
    print(_mos_table(out / "mos.csv"))
    print(f"report in {out / 'report.html'}")


def scenes(options: argparse.Namespace) -> None:
    """Render City or Landscape into a file."""
    from dsis.imagefile import LIGHT_FORMATS, write_light
    from dsis.scenes import panorama, preset_strip

    out: Path = options.out
    seed = 1 if options.seed is None else options.seed
    strip = preset_strip(options.preset, options.name, seed)
    if out.is_dir() or out.suffix.lower() not in LIGHT_FORMATS:
        fact = f"must be a file that ends in one of: {', '.join(LIGHT_FORMATS)}"
        raise InputError.of("--out", "", f"is {str(out)!r}, {fact}")
    out.parent.mkdir(parents=True, exist_ok=True)
    with _progress(strip.scene) as progress:
        light = panorama(strip, threads=options.jobs, progress=progress)
    write_light(out, light, f"{strip}; linear light, Rec.709 primaries, D65, 1.0 a sunlit white")
    print(f"{strip} in {out}: linear light, Rec.709 primaries, 1.0 a sunlit white")


def plan(options: argparse.Namespace) -> None:
    """Say how many observers a test needs, or what power a pilot promises."""
    from analysis.planning.command import describe_plan, write_power

    if options.pilot is None:
        print(describe_plan(options))
    else:
        print(write_power(options))


def camera_fit(options: argparse.Namespace) -> None:
    """Fit a camera model to a recording by photon transfer."""
    from analysis.photon_transfer import fit_camera, summary, write_fit
    from dsis.recording import read_recording

    recording = read_recording(options.recording)
    with _progress("fit") as progress:
        fit = fit_camera(recording, options.segments, threads=options.jobs, progress=progress)
    write_fit(fit, options.out)
    print(summary(fit))
    print(f"camera model in {options.out}")


def camera_simulate(options: argparse.Namespace) -> None:
    """Write a recording of a camera model with the layout of another recording."""
    from dsis.camera import read_camera
    from dsis.recording import read_recording
    from dsis.simulate import read_maps, simulate_like

    camera = read_camera(options.camera)
    maps = read_maps(options.camera) if options.same_sensor else None
    recording = read_recording(options.like)
    with _progress("simulate") as progress:
        simulate_like(
            camera,
            recording,
            options.out,
            seed=options.seed or 0,
            maps=maps,
            jobs=options.jobs,
            progress=progress,
        )
    frames = sum(len(exposure.frames) for exposure in recording.exposures)
    print(f"{frames} frames in {len(recording.exposures)} exposures, simulated, in {options.out}")


def mismatch(options: argparse.Namespace) -> None:
    """Say where recordings differ from a camera model, and what physics it leaves out."""
    from analysis.mismatch.folders import diagnose_recordings
    from analysis.mismatch.report.summary import comparison, summary

    with _progress("mismatch") as progress:
        found = diagnose_recordings(
            options.camera,
            options.recordings,
            options.out,
            seed=options.seed or 0,
            jobs=options.jobs,
            without=options.without,
            scheduler=options.scheduler,
            progress=progress,
        )
    for one in found:
        print(f"# {one.name}\n\n{summary(one.finding)}")
    if len(found) > 1:
        print(comparison({one.name: one.finding for one in found}))
    for one in found:
        print(f"report in {one.folder / 'report.html'}, model in {one.folder / 'camera.toml'}")


def paper(options: argparse.Namespace) -> None:
    """Recompute the tables and figures of the paper."""
    from analysis.paper import Setting, kodak_images, real_recording, write_paper

    setting = Setting(
        kodak=kodak_images(options.kodak),
        recording=real_recording(options.recording),
        votes=options.votes,
        scale=tuple(options.scale) if options.scale else None,
        full=options.full,
        seed=1 if options.seed is None else options.seed,
        jobs=options.jobs,
    )
    with _progress("paper") as progress:
        parts = write_paper(options.out, setting, options.names, progress)
    for part in parts:
        print(f"{part.title}: {len(part.pictures)} figures, {len(part.all_tables())} tables")
    print(f"page in {options.out / 'paper.html'}")


@contextmanager
def _progress(what: str) -> Iterator[Callable[[int, int, str], None]]:
    """Show a bar on a terminal once the work has taken two seconds."""
    from tqdm import tqdm

    with tqdm(desc=what, delay=2, disable=None, leave=False, dynamic_ncols=True) as bar:

        def tell(done: int, total: int, doing: str) -> None:
            bar.total = total
            bar.set_postfix_str(doing, refresh=False)
            bar.update(done - bar.n)

        yield tell


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _whole(low: int, high: int = 2**63 - 1) -> Callable[[str], int]:
    def whole(text: str) -> int:
        if not text.isdecimal() or not low <= int(text) <= high:
            message = f"is {text!r}, must be a whole number from {low} to {high}"
            raise argparse.ArgumentTypeError(message)
        return int(text)

    return whole


Add = Callable[..., argparse.ArgumentParser]
Commands: TypeAlias = "argparse._SubParsersAction[argparse.ArgumentParser]"  # noqa: SLF001 - argparse has no public name for it


def _number(low: float = -math.inf) -> Callable[[str], float]:
    def number(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value) or value < low:
            bound = "" if low == -math.inf else f" from {low:g}"
            message = f"is {text!r}, must be a number{bound}"
            raise argparse.ArgumentTypeError(message)
        return value

    return number


def _adder(
    commands: "argparse._SubParsersAction[argparse.ArgumentParser]", prefix: str = ""
) -> Add:
    """Return what adds a command with its help and an example to a group of commands."""

    def add(
        name: str, function: Callable[[argparse.Namespace], None], says: str, example: str
    ) -> argparse.ArgumentParser:
        sub = commands.add_parser(
            name,
            help=says,
            description=says,
            epilog=f"example:\n  dsis {prefix}{example}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        sub.set_defaults(command=function)
        return sub

    return add


def _add_jobs(sub: argparse.ArgumentParser) -> None:
    sub.add_argument(
        "--jobs", type=_whole(1), default=_cores(), metavar="N", help="threads (default: all)"
    )


def _add_scheduler(sub: argparse.ArgumentParser) -> None:
    cluster = "of a Dask cluster that does the work instead: tcp://HOST:8786 (extra dsis[cluster])"
    sub.add_argument("--scheduler", metavar="ADDRESS", help=cluster)


def _add_seed(sub: argparse.ArgumentParser, default: str) -> None:
    sub.add_argument(
        "--seed", type=_whole(0), metavar="N", help=f"fixes every random number ({default})"
    )


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="dsis",
        description="Prepare, run and analyse a double-stimulus impairment test (ITU-R BT.500) "
        "of real camera noise.",
        epilog="Start with: dsis demo",
    )
    parser.add_argument("--version", action="version", version=f"dsis {__version__}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    add = _adder(commands)
    _add_demo(add)
    _add_stimuli(add)
    _add_session(add)
    _add_votes(add)
    _add_report(add)
    _add_scenes(add)
    _add_plan(add)
    _add_camera(commands)
    _add_mismatch(add)
    _add_paper(add)
    return parser


def _add_demo(add: Add) -> None:
    sub = add(
        "demo",
        demo,
        "The whole chain in small: stimuli, a session of simulated observers, the MOS report.",
        "demo --out my-demo",
    )
    sub.add_argument("--out", type=Path, default=Path("dsis-demo"), metavar="DIR")
    sub.add_argument("--observers", type=_whole(1), default=DEMO_OBSERVERS, metavar="N")
    _add_jobs(sub)
    _add_seed(sub, "default: the spec's")


def _add_stimuli(add: Add) -> None:
    sub = add(
        "stimuli",
        stimuli,
        "Build the sequences that a test spec names, with a manifest.",
        "stimuli stills.toml --source photos/ --out stimuli",
    )
    spec = "a file, the name of a spec that comes with dsis, or a manifest.json"
    sub.add_argument("spec", nargs="?", metavar="SPEC.toml", help=spec)
    sub.add_argument("--out", type=Path, metavar="DIR", help="default: SPEC-stimuli")
    frames = "your frames instead of the spec's content"
    sub.add_argument("--source", nargs="+", default=[], metavar="FILES", help=frames)
    sub.add_argument("--dry-run", action="store_true", help="say disk, memory, time; build nothing")
    check = "verify every frame against the manifest"
    sub.add_argument("--check", type=Path, metavar="DIR", help=check)
    _add_jobs(sub)
    _add_scheduler(sub)
    _add_seed(sub, "default: the spec's")


def _add_session(add: Add) -> None:
    sub = add(
        "session",
        session,
        "Run the test with people in the browser, or with simulated observers.",
        "session stimuli --observer anna",
    )
    sub.add_argument("stimuli_dir", type=Path, metavar="STIMULI_DIR")
    sub.add_argument("--observer", metavar="ID", help="pseudonym of the person who votes")
    what = sub.add_mutually_exclusive_group()
    what.add_argument("--robots", type=_whole(1), metavar="N", help="simulated observers instead")
    what.add_argument("--resume", action="store_true", help="go on with an interrupted session")
    what.add_argument("--status", action="store_true", help="how far it is; never scores")
    plan = "draw, check and store the orders of the panel (or of --observer ID) and show them"
    what.add_argument("--plan", action="store_true", help=plan)
    setup = "the laboratory's set-up: consent, hidden references, display"
    sub.add_argument("--setup", type=Path, metavar="FILE.toml", help=setup)
    player = "what shows the clips (default: the page)"
    sub.add_argument("--player", choices=("page", "mpv"), default="page", help=player)
    sub.add_argument("--screen", type=_whole(0), metavar="N", help="screen for mpv, from 0")
    output = "mpv's video output (default: gpu; x11 where there is no GPU)"
    sub.add_argument("--video-output", choices=("gpu", "x11"), default="gpu", help=output)
    sheets = "printable score sheets and plans, for a player of your own"
    what.add_argument("--sheets", type=Path, metavar="DIR", help=sheets)
    typed = "votes typed in from score sheets: observer, presentation, vote"
    what.add_argument("--typed", type=Path, metavar="FILE.csv", help=typed)
    forget = "erase the personal data of an observer"
    what.add_argument("--forget", metavar="ID", help=forget)
    port = "port on 127.0.0.1 (default: a free one)"
    sub.add_argument("--port", type=_whole(0), default=0, help=port)
    sub.add_argument("--no-browser", action="store_true", help="print the address only")
    _add_seed(sub, "default: 1")


def _add_votes(add: Add) -> None:
    sub = add(
        "votes",
        votes,
        "Export the recorded votes: votes.csv and the tables beside it.",
        "votes stimuli -o votes",
    )
    sub.add_argument("stimuli_dir", type=Path, metavar="STIMULI_DIR")
    sub.add_argument("-o", "--out", type=Path, required=True, metavar="DIR")
    personal = "with people.csv: age groups, screening; never without this word"
    sub.add_argument("--personal", action="store_true", help=personal)


def _add_report(add: Add) -> None:
    sub = add(
        "report",
        report,
        "Write the MOS report of a table of votes.",
        "report votes/votes.csv --out report",
    )
    files = "votes.csv, wide CSV, sureal's .json or a stimuli folder; several: laboratories"
    sub.add_argument("votes", type=Path, nargs="+", metavar="VOTES.csv", help=files)
    sub.add_argument("--out", type=Path, metavar="DIR", help="default: VOTES-report")
    _add_scale(sub)
    reject = "observer to leave out, may be repeated: your decision, never the report's"
    sub.add_argument("--reject", action="append", default=[], metavar="OBSERVER", help=reject)
    accept = "an earlier report's rejections.csv, with accept set to true where you agree"
    sub.add_argument("--accept", type=Path, metavar="FILE", help=accept)
    threshold = "standard deviations beyond which votes are removed (default: 2)"
    sub.add_argument("--threshold", type=_number(1.0), default=2.0, metavar="SD", help=threshold)
    passes = "how often they are (default: 1)"
    sub.add_argument("--passes", type=_whole(1, 100), default=1, metavar="N", help=passes)


def _add_scale(sub: argparse.ArgumentParser) -> None:
    ends = "ends of the scale, worst first; default: datapackage.json"
    sub.add_argument("--scale", nargs=2, type=_number(), metavar=("LOW", "HIGH"), help=ends)


def _add_scenes(add: Add) -> None:
    sub = add(
        "scenes",
        scenes,
        "Render the panorama of City or Landscape, in linear light, at twice the preset's size. It "
        "is kept: in $DSIS_CACHE/scenes if that is set, else in dsis/scenes of the user's cache "
        "folder ($XDG_CACHE_HOME or ~/.cache; ~/Library/Caches; LOCALAPPDATA).",
        "scenes city --preset lab --out city.exr",
    )
    sub.add_argument("name", metavar="NAME", help="city or landscape")
    preset = "of clips: quick (480x270), standard (960x540, the default) or lab (1920x1080)"
    sub.add_argument("--preset", default="standard", metavar="P", help=preset)
    out = "float32: .exr, .tif"
    sub.add_argument("--out", type=Path, required=True, metavar="FILE.exr", help=out)
    _add_jobs(sub)
    _add_seed(sub, "default: 1")


def _add_plan(add: Add) -> None:
    sub = add(
        "plan",
        plan,
        "Say how many observers a test needs, from a difference of MOS or from a pilot's votes.",
        "plan --difference 0.5 --sd 1 --comparisons 12",
    )
    difference = "of two mean opinion scores that shall be shown, grades"
    sub.add_argument("--difference", type=_number(), metavar="GRADES", help=difference)
    sd = "of an observer's difference of two votes (of votes, with --groups), grades"
    sub.add_argument("--sd", type=_number(), metavar="GRADES", help=sd)
    comparisons = "how many differences are tested (default: 1)"
    sub.add_argument("--comparisons", type=_whole(1), default=1, metavar="N", help=comparisons)
    correction = "for several comparisons (default: bonferroni)"
    sub.add_argument(
        "--correction", choices=("bonferroni", "holm"), default="bonferroni", help=correction
    )
    groups = "two groups of observers, one for each score, instead of one that judges both"
    sub.add_argument("--groups", action="store_true", help=groups)
    power = "chance to show the difference (default: 0.8)"
    sub.add_argument("--power", type=_number(), default=0.8, metavar="P", help=power)
    alpha = "chance to show one that is not there (default: 0.05)"
    sub.add_argument("--alpha", type=_number(), default=0.05, metavar="P", help=alpha)
    pilot = "votes of a pilot: power curves, simulated with the observers fitted to it"
    sub.add_argument("--pilot", type=Path, metavar="VOTES.csv", help=pilot)
    _add_scale(sub)
    sizes = "numbers of observers to try with a pilot"
    sub.add_argument("--observers", type=_whole(2, 10_000), nargs="+", metavar="N", help=sizes)
    out = "folder for the table and the figure of a pilot (default: PILOT-plan)"
    sub.add_argument("--out", type=Path, metavar="DIR", help=out)
    _add_seed(sub, "default: 1")


def _add_camera(commands: Commands) -> None:
    says = "Camera models: fitted to recordings, and simulated."
    group = commands.add_parser(
        "camera",
        help=says,
        description=says,
        epilog="example:\n  dsis camera fit RECORDING -o camera.toml",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = _adder(group.add_subparsers(required=True, metavar="COMMAND"), "camera ")
    sub = add(
        "fit",
        camera_fit,
        "Fit the paper's camera model to a recording by photon transfer.",
        "fit recording -o camera.toml",
    )
    recording = "folder with recording.toml, or an EMVA 1288 descriptor file"
    sub.add_argument("recording", type=Path, metavar="RECORDING", help=recording)
    sub.add_argument("-o", "--out", type=Path, required=True, metavar="camera.toml")
    segments = "read-out segments (default: as the data need)"
    sub.add_argument("--segments", type=_whole(1), metavar="N", help=segments)
    _add_jobs(sub)
    sub = add(
        "simulate",
        camera_simulate,
        "Write a recording of a camera model, laid out like another recording.",
        "simulate camera.toml --like recording -o simulated",
    )
    sub.add_argument("camera", type=Path, metavar="camera.toml")
    like = "recording whose exposures, frame counts, size and signal levels are taken"
    sub.add_argument("--like", type=Path, required=True, metavar="RECORDING", help=like)
    sub.add_argument("-o", "--out", type=Path, required=True, metavar="DIR")
    same = "fixed patterns from the maps.npz beside camera.toml instead of a new sensor's"
    sub.add_argument("--same-sensor", action="store_true", help=same)
    _add_jobs(sub)
    _add_seed(sub, "default: 0")


def _add_mismatch(add: Add) -> None:
    sub = add(
        "mismatch",
        mismatch,
        "Say where recordings differ from a camera model, and what physics it leaves out.",
        "mismatch camera.toml recording -o diagnosis",
    )
    sub.add_argument("camera", type=Path, metavar="camera.toml")
    recordings = "folder with recording.toml, or an EMVA 1288 descriptor file; one or several"
    sub.add_argument("recordings", type=Path, nargs="+", metavar="RECORDING", help=recordings)
    out = "mismatch.json, report.html, camera.toml; of several recordings: a folder for each"
    sub.add_argument("-o", "--out", type=Path, required=True, metavar="DIR", help=out)
    without = "effects that must not be named; may be given several times"
    sub.add_argument(
        "--without", nargs="+", action="extend", default=[], metavar="EFFECT", help=without
    )
    _add_jobs(sub)
    _add_scheduler(sub)
    _add_seed(sub, "default: 0")


def _add_paper(add: Add) -> None:
    sub = add(
        "paper",
        paper,
        "Recompute the paper's tables and figures, printed beside the published numbers.",
        "paper table1 --kodak kodak/ --out paper",
    )
    names = (
        "of claims, fig1, fig2, table1, equation5, fig3, fig4, fig5, fig6, table2 (default: all)"
    )
    sub.add_argument("names", nargs="*", metavar="NAME", help=names)
    sub.add_argument("--out", type=Path, default=Path("dsis-paper"), metavar="DIR")
    full = "20 frames of 1920 x 1080, hours; default: 1 frame of 480 x 270, minutes"
    sub.add_argument("--full", action="store_true", help=full)
    kodak = "folder of the 24 Kodak images (default: $DSIS_SHARED_DATA/kodak, else City)"
    sub.add_argument("--kodak", type=Path, metavar="FOLDER", help=kodak)
    votes = "votes of a test with the paper's conditions, for Fig. 6 (default: robots)"
    sub.add_argument("--votes", type=Path, metavar="FILE", help=votes)
    _add_scale(sub)
    recording = "a real camera's recording for Fig. 2 (default: that of $DSIS_SHARED_DATA)"
    sub.add_argument("--recording", type=Path, metavar="RECORDING", help=recording)
    _add_jobs(sub)
    _add_seed(sub, "default: 1")


if __name__ == "__main__":
    sys.exit(main())
