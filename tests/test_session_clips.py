"""Promise: clips of one's own are shown exactly as they are, or refused before one is shown."""

import shutil
import subprocess

import numpy as np
import pytest

from dsis.errors import DamagedError, InputError
from dsis.imagefile import write_codes
from dsis.manifest import ClipFiles, read_manifest
from dsis.session import serve
from dsis.session.clips import check_playable, checked_clip, prepare_clips
from dsis.session.memory import available_memory_bytes, check_memory, clips_kept
from dsis.spec import Sequence
from tiny_clips import SIZE, write_test


@pytest.fixture
def folder(tmp_path):
    write_test(tmp_path / "stimuli")
    return tmp_path / "stimuli"


def test_what_does_not_fit_into_memory_is_refused_before_anything_is_shown(folder):
    manifest = read_manifest(folder).model_copy(
        update={"sequence": Sequence(width=1920, height=1080, fps=25.0, seconds=10.0)}
    )
    needed = 2 * 250 * 1920 * 1080 * 4 + 512 * 2**20  # 4.7 GB
    check_memory(manifest, folder, needed)
    check_memory(manifest, folder, None)
    with pytest.raises(InputError, match=r"needs 4\.7 GB of memory, 4\.6 GB are free"):
        check_memory(manifest, folder, needed - 10**8)
    assert clips_kept(manifest, needed) == 2
    assert clips_kept(manifest, 10**12) == 8
    assert clips_kept(manifest, None) == 2
    assert available_memory_bytes() > 0


def frames():
    return np.random.default_rng(3).integers(0, 256, (4, 12, 16, 3), np.uint8)


def write_images(folder, kind="png"):
    (folder / "mine").mkdir(parents=True)
    for i, frame in enumerate(frames(), 8):  # 8, 9, 10, 11: natural order
        write_codes(folder / "mine" / f"{i}.{kind}", frame)


@pytest.mark.parametrize("form", ["png8", "frames"])
@pytest.mark.parametrize("kind", ["png", "tif"])
def test_image_files_are_shown_as_they_are(tmp_path, form, kind):
    folder = tmp_path / "stimuli"
    write_images(folder, kind)
    manifest = write_test(folder, {form: ClipFiles(path=f"mine/*.{kind}")})
    check_playable(manifest, folder)
    said = []
    prepare_clips(manifest, folder, said.append)
    assert said == ["clip 2 of 6 made ready: city__one"]
    clip = checked_clip(manifest, folder, manifest.clip("city__one"))
    assert b"".join(clip.frame(i) for i in range(4)) == frames().tobytes()
    prepare_clips(manifest, folder, said.append)
    assert len(said) == 1  # nothing has changed
    clip.path.write_bytes(clip.path.read_bytes()[:-1] + b"\0")
    if frames().tobytes()[-1]:
        with pytest.raises(DamagedError, match="differs from the manifest"):
            checked_clip(manifest, folder, manifest.clip("city__one"))


def test_a_lossless_video_is_shown_as_it_is(tmp_path):
    if shutil.which("ffmpeg") is None:
        pytest.skip("ffmpeg is not installed")
    folder = tmp_path / "stimuli"
    folder.mkdir()
    raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", "16x12", "-r", "25", "-i", "-"]
    for name, codec in {
        "good.mkv": ["-c:v", "ffv1", "-pix_fmt", "gbrp"],
        "subsampled.mkv": ["-c:v", "ffv1", "-pix_fmt", "yuv420p"],
        "lossy.avi": ["-c:v", "mjpeg"],
    }.items():
        command = ["ffmpeg", "-v", "error", *raw, *codec, str(folder / name)]
        subprocess.run(command, input=frames().tobytes(), check=True)
    manifest = write_test(folder, {"video": ClipFiles(path="good.mkv")})
    prepare_clips(manifest, folder)
    clip = checked_clip(manifest, folder, manifest.clip("city__one"))
    assert b"".join(clip.frame(i) for i in range(4)) == frames().tobytes()
    for name, why in (("subsampled.mkv", "must be 8-bit RGB"), ("lossy.avi", "must be lossless")):
        manifest = write_test(folder, {"video": ClipFiles(path=name)})
        with pytest.raises(InputError, match=why):
            prepare_clips(manifest, folder)


def test_clips_that_cannot_be_shown_exactly_are_refused(tmp_path):
    folder = tmp_path / "stimuli"
    write_images(folder)
    deep = (frames()[0].astype(np.uint16)) << 8
    write_codes(folder / "deep" / "0.tif", deep)
    write_codes(folder / "small" / "0.png", frames()[0][:6])
    for path, why in (
        ("deep/*.tif", "is uint16, must be a lossless file of 8 bits"),
        ("small/*.png", "is 16 x 6, must be 16 x 12"),
        ("mine/8.png", "has 1 frames, must have 4"),
        ("none/*.png", "names 0 files"),
    ):
        manifest = write_test(folder, {"frames": ClipFiles(path=path)})
        with pytest.raises(InputError, match=why):
            prepare_clips(manifest, folder)
    wrong = ClipFiles(path="mine/*.png", frame_sha256=("0" * 64,) * 4)
    with pytest.raises(InputError, match=r"differs from the manifest \(SHA-256\)"):
        prepare_clips(write_test(folder, {"frames": wrong}), folder)


@pytest.mark.parametrize("form", ["player", "frames"])
def test_a_manifest_never_leads_out_of_its_folder(tmp_path, form):
    outside = tmp_path / "outside.rgb"
    outside.write_bytes(bytes(SIZE.frames * 16 * 12 * 3))
    folder = tmp_path / "stimuli"
    for path in ("../outside.rgb", str(outside)):
        write_test(folder, {form: ClipFiles(path=path)})
        with pytest.raises(InputError, match="must stay inside the manifest's folder"):
            serve(folder, "anna", open_browser=False)
    (folder / "link.rgb").symlink_to(outside)
    write_test(folder, {form: ClipFiles(path="link.rgb")})
    with pytest.raises(InputError, match="leads out of the manifest's folder"):
        serve(folder, "anna", open_browser=False)
    assert not (folder / "session" / "votes.sqlite").exists()
