"""`dsis scenes`: render City or Landscape."""

import argparse
from pathlib import Path

from dsis.cli.arguments import Add, add_jobs, add_scheduler, add_seed
from dsis.cli.progress import progress_bar
from dsis.errors import InputError


def add_scenes(add: Add) -> None:
    """Say what `dsis scenes` takes."""
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
    add_jobs(sub)
    add_scheduler(sub)
    add_seed(sub, "default: 1")


def scenes(options: argparse.Namespace) -> None:
    """Render City or Landscape into a file."""
    from dsis.imagefile import LIGHT_FORMATS, begin, write_light
    from dsis.scenes import panorama, preset_strip
    from dsis.workers import workers

    out: Path = options.out
    seed = 1 if options.seed is None else options.seed
    strip = preset_strip(options.preset, options.name, seed)
    if out.is_dir() or out.suffix.lower() not in LIGHT_FORMATS:
        fact = f"must be a file that ends in one of: {', '.join(LIGHT_FORMATS)}"
        raise InputError.of("--out", "", f"is {str(out)!r}, {fact}")
    begin(out).unlink()  # rendering takes minutes: what cannot be written is refused before
    with (
        workers(options.jobs, scheduler=options.scheduler) as pool,
        progress_bar(strip.scene) as progress,
    ):
        light = panorama(strip, pool=pool, progress=progress)
    write_light(out, light, f"{strip}; linear light, Rec.709 primaries, D65, 1.0 a sunlit white")
    print(f"{strip} in {out}: linear light, Rec.709 primaries, 1.0 a sunlit white")
