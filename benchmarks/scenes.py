"""What City and Landscape hold, and what they cost.

`python benchmarks/scenes.py [--scenes city landscape] [--presets quick standard lab]
[--contact-sheet FOLDER]`; `--ship` and `--check-shipped` are for the panoramas that come with dsis.

Everything but the range is measured on clips: after the optics of the shipped tests, panned, in
8-bit luma of BT.709. Definitions:

range      stops between the 0.1st and the 99.9th percentile of the panorama's linear luminance
flat       share of 8 x 8 blocks whose standard deviation of luma is below 2; textured: above 8
SI, TI     ITU-T P.910: largest standard deviation of the Sobel-filtered frame, and of the
           difference of successive frames, over 24 frames that lie evenly on the pan
clipped    share of pixels of which a channel exceeds white; in brackets: of which luminance does
twinkle    a still thing panned by eighths of a pixel and moved back: standard deviation of a
           point's luma over the eight phases, 99th percentile over points; the share above 16
ringing    half a fine pixel on by phase ramp against a panorama rendered half a fine pixel on: rms
           of the difference, of white (240 rows)
render     CPU seconds per megapixel of the panorama, all threads summed, compilation apart
memory     largest resident size of a process that renders and takes one frame
"""

import argparse
import multiprocessing
import resource
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import OpenImageIO as oiio  # noqa: N813 - the name that its own examples use
from numpy.typing import NDArray
from scipy import fft
from scipy.ndimage import sobel

from dsis.imagefile import codes, write
from dsis.optics import Optics, Pan
from dsis.scenes import OVERSAMPLING, PRESETS, SCENES, Preset, Strip, preset_strip, render
from dsis.scenes.shipped import SHIPPED, as_shipped, ship
from dsis.spec import Sequence, read_spec
from dsis.stimuli.frames import FrameMaker
from dsis.stimuli.jobs import jobs_of
from dsis.stimuli.panoramas import render_panoramas
from dsis.stimuli.source import Window

Field = NDArray[np.float32]
REC709_LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)  # ITU-R BT.709-6, item 3.2
FRAMES, PHASES, BLOCK = 24, 8, 8
SCREEN_S = 19.2  # a width goes by in that time: 4 pixels a frame at 1920 x 1080 and 25 fps


def luma(light: Field) -> Field:
    """Return 8-bit luma of the BT.709 camera curve (item 1.2), not rounded."""
    clipped = np.clip(light, 0, 1)
    curve = np.where(clipped < 0.018, 4.5 * clipped, 1.099 * clipped**0.45 - 0.099)
    return np.asarray(255 * curve @ REC709_LUMINANCE, np.float32)


def blocks(plane: Field) -> Field:
    """Return (row, column, 64) of the whole blocks of 8 x 8."""
    rows, columns = (n // BLOCK for n in plane.shape)
    cut = plane[: rows * BLOCK, : columns * BLOCK].reshape(rows, BLOCK, columns, BLOCK)
    return cut.swapaxes(1, 2).reshape(rows, columns, BLOCK * BLOCK)


def clip(image: Field, preset: Preset, speed: float, frames: int) -> Window:
    size = Sequence(width=preset.width, height=preset.height, fps=25, seconds=frames / 25)
    return Window(image, optics(), size, OVERSAMPLING, speed)


def optics() -> Optics:
    return read_spec("seybold.toml").spec.optics


def twinkle(image: Field, preset: Preset) -> tuple[float, float]:
    window = clip(image, preset, 1 / PHASES, PHASES)
    seen = []
    for phase in range(PHASES):
        light = window.light(phase)
        there_and_back = np.concatenate([light, light[:, ::-1]], axis=1)  # no edge to ring
        frequency = fft.rfftfreq(2 * preset.width)[:, None]
        ramp = np.exp(-2j * np.pi * frequency * phase / PHASES).astype(np.complex64)
        back = fft.irfft(fft.rfft(there_and_back, axis=1) * ramp, axis=1)[:, : preset.width]
        seen.append(luma(back[:, 32:-32]))
    spread = np.std(seen, axis=0)
    return float(np.percentile(spread, 99)), float((spread > 16).mean())


def ringing(scene: str, seed: int) -> float:
    rows, columns = 240, 400
    fine = render(Strip(scene, seed, 2 * rows, 2 * columns))
    here = fine.reshape(rows, 2, columns, 2, 3).mean(axis=(1, 3))
    on = fine[:, 1:-1].reshape(rows, 2, columns - 1, 2, 3).mean(axis=(1, 3))
    by_ramp, rendered = (
        Pan.of(light, optics(), OVERSAMPLING).window(place, rows // 2, 150)
        for light, place in ((here, 40.5), (on, 40.0))
    )
    return float(np.sqrt(np.mean((by_ramp - rendered) ** 2)))


def measured(scene: str, name: str, seed: int, threads: int, share: float) -> tuple[str, Field]:
    """Render one panorama; return its row of the table and its contact sheet."""
    whole = PRESETS[name]
    preset = replace(whole, width=int(share * whole.width), travel=int(share * whole.travel))
    columns = OVERSAMPLING * (preset.width + preset.travel)
    strip = replace(preset_strip(name, scene, seed), columns=columns)
    render(Strip(scene, seed, 32, 32))  # compiles
    begun = time.process_time()
    image = render(strip, threads)
    cpu_s = time.process_time() - begun
    megapixels = strip.rows * strip.columns / 1e6
    speed = whole.width / (SCREEN_S * 25)
    window = clip(image, preset, speed, 1 + int(preset.travel / speed))
    window.light(0)
    memory_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
    dark, bright = np.percentile(image @ REC709_LUMINANCE, [0.1, 99.9])
    spread, above, clipped, spatial, temporal = [], [], [], [], []
    for first, second in frame_pairs(window, int(preset.travel / speed)):
        one, next_one = luma(first), luma(second)
        spread.append(blocks(one).std(axis=2).ravel())
        above.append((first.max(axis=2) > 1).mean())
        clipped.append((first @ REC709_LUMINANCE > 1).mean())
        spatial.append(np.hypot(sobel(one, 0), sobel(one, 1))[1:-1, 1:-1].std())
        temporal.append((next_one - one).std())
    flat, textured = (np.concatenate(spread) < 2).mean(), (np.concatenate(spread) > 8).mean()
    shimmer, share = twinkle(image, preset)
    glare, white = 100 * np.mean(above), 100 * np.mean(clipped)
    row = (
        f"{scene:10}{name:9}{np.log2(bright / dark):6.1f}{100 * flat:7.1f}{100 * textured:7.1f}"
        f"{max(spatial):7.1f}{max(temporal):7.1f}{glare:8.3f} ({white:.3f})"
        f"{shimmer:9.2f} ({100 * share:.2f}){100 * ringing(scene, seed):8.2f}"
        f"{cpu_s / megapixels:10.2f}{memory_mb:8.0f}"
    )
    return row, contact_sheet(window, int(preset.travel / speed))


def frame_pairs(window: Window, travel: int) -> Iterator[tuple[Field, Field]]:
    for frame in np.linspace(0, travel - 1, FRAMES).astype(int):
        yield window.light(int(frame)), window.light(int(frame) + 1)


def contact_sheet(window: Window, travel: int) -> Field:
    """Return frames along the pan, and below each what the next one changes, x 2 + 128."""
    columns = []
    for frame in np.linspace(0, travel - 1, 3).astype(int):
        one, following = (shown(window.light(int(frame) + k)) for k in (0, 1))
        columns.append(np.concatenate([one, 2 * (following - one) + 0.5]))
    return np.concatenate(columns, axis=1)


def shown(light: Field) -> Field:
    clipped = np.clip(light, 0, 1)
    curve = np.where(clipped < 0.018, 4.5 * clipped, 1.099 * clipped**0.45 - 0.099)
    return np.asarray(curve, np.float32)


def check_shipped(threads: int) -> None:
    for strip in SHIPPED:
        held, rendered = as_shipped(strip), render(strip, threads)
        if held is None:
            print(f"{strip}: is not there")
            continue
        away = np.abs(held - rendered) > 2.0**-11 * rendered + 1e-7
        print(f"{strip}: {away.mean():.2e} of the samples are not the renderer's half floats")


def stills(folder: Path, threads: int) -> None:
    """Write the first frame of both scenes at 960 x 540, as an observer sees it."""
    test = read_spec("seybold.toml")
    small = Sequence(width=960, height=540, fps=25, seconds=1 / 25)
    given = test.spec.awgn.model_copy(update={"match": None, "sigma": 1.0})  # nothing to solve
    alone = test.spec.session.model_copy(update={"training": 0})
    changes = {"sequence": small, "awgn": given, "session": alone}
    test = replace(test, spec=test.spec.model_copy(update=changes))
    render_panoramas(test, threads=threads)
    for job in jobs_of(test):
        _, reference, _ = next(iter(FrameMaker.of(test, job).frame(0)))
        pixels = oiio.ImageBuf(np.ascontiguousarray(codes(reference, 255)))
        pixels.specmod().attribute("png:compressionLevel", 9)
        pixels.write(str(folder / f"{job.name}.png"))


def main() -> None:
    parser = argparse.ArgumentParser(description="What City and Landscape hold, and cost.")
    parser.add_argument("--scenes", nargs="+", choices=SCENES, default=SCENES)
    parser.add_argument("--presets", nargs="+", choices=PRESETS, default=["quick"])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=2)
    share = "of the panorama's width, from the left: for a quick look at a large preset"
    parser.add_argument("--share", type=float, default=1.0, help=share)
    parser.add_argument("--contact-sheet", type=Path, metavar="FOLDER")
    ship_says = "render what comes with dsis and write it into the package; measure nothing"
    parser.add_argument("--ship", action="store_true", help=ship_says)
    check = "compare all that comes with dsis with what the renderers give; measure nothing"
    parser.add_argument("--check-shipped", action="store_true", help=check)
    pictures = "write the README's stills there; measure nothing"
    parser.add_argument("--stills", type=Path, metavar="FOLDER", help=pictures)
    options = parser.parse_args()
    if options.stills:
        stills(options.stills, options.threads)
        return
    if options.ship or options.check_shipped:
        if options.ship:
            ship(options.threads)
        check_shipped(options.threads)
        return
    print(
        f"{'':19}{'stops':>6}{'flat %':>7}{'text. %':>7}{'SI':>7}{'TI':>7}{'clipped %':>16}"
        f"{'twinkle (>16)':>16}{'ring. %':>8}{'CPU-s/Mpx':>10}{'MB':>8}"
    )
    for scene in options.scenes:
        for preset in options.presets:
            # A process of its own: its largest size is this panorama's.
            context = multiprocessing.get_context("spawn")
            with ProcessPoolExecutor(1, mp_context=context) as alone:
                work = alone.submit(
                    measured, scene, preset, options.seed, options.threads, options.share
                )
                row, sheet = work.result()
            print(row, flush=True)
            if options.contact_sheet:
                write(options.contact_sheet / f"{scene}-{preset}.png", sheet, "png8")


if __name__ == "__main__":
    main()
