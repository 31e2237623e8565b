"""`dsis session` and `dsis votes`: run the test, export what was voted."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from dsis.cli.arguments import Add, add_seed, whole
from dsis.errors import InputError

if TYPE_CHECKING:
    from dsis.session.player import Player


def add_session(add: Add) -> None:
    """Say what `dsis session` takes."""
    sub = add(
        "session",
        session,
        "Run the test with people in the browser, or with simulated observers.",
        "session stimuli --observer anna",
    )
    sub.add_argument("stimuli_dir", type=Path, metavar="STIMULI_DIR")
    sub.add_argument("--observer", metavar="ID", help="pseudonym of the person who votes")
    what = sub.add_mutually_exclusive_group()
    what.add_argument("--robots", type=whole(1), metavar="N", help="simulated observers instead")
    what.add_argument("--resume", action="store_true", help="go on with an interrupted session")
    what.add_argument("--status", action="store_true", help="how far it is; never scores")
    plan = "draw, check and store the orders of the panel (or of --observer ID) and show them"
    what.add_argument("--plan", action="store_true", help=plan)
    setup = "the laboratory's set-up: consent, hidden references, display"
    sub.add_argument("--setup", type=Path, metavar="FILE.toml", help=setup)
    player = "what shows the clips (default: the page)"
    sub.add_argument("--player", choices=("page", "mpv"), default="page", help=player)
    sub.add_argument("--screen", type=whole(0), metavar="N", help="screen for mpv, from 0")
    output = "mpv's video output (default: gpu; x11 where there is no GPU)"
    sub.add_argument("--video-output", choices=("gpu", "x11"), default="gpu", help=output)
    sheets = "printable score sheets and plans, for a player of your own"
    what.add_argument("--sheets", type=Path, metavar="DIR", help=sheets)
    typed = "votes typed in from score sheets: observer, presentation, vote"
    what.add_argument("--typed", type=Path, metavar="FILE.csv", help=typed)
    forget = "erase the personal data of an observer"
    what.add_argument("--forget", metavar="ID", help=forget)
    port = "port on 127.0.0.1 (default: a free one)"
    sub.add_argument("--port", type=whole(0), default=0, help=port)
    sub.add_argument("--no-browser", action="store_true", help="print the address only")
    add_seed(sub, "default: 1")


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


def add_votes(add: Add) -> None:
    """Say what `dsis votes` takes."""
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


def votes(options: argparse.Namespace) -> None:
    """Export the recorded votes."""
    from dsis.session import export_votes

    simulated = export_votes(options.stimuli_dir, options.out, personal=options.personal)
    if simulated != "none":
        print(f"SIMULATED: {simulated} of these votes are of robots, not of people")
    print(f"votes in {options.out / 'votes.csv'}; report: dsis report {options.out / 'votes.csv'}")
