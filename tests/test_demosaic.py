"""Every demosaicking algorithm does what its equations say, at any phase, size and border."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from OpenImageIO import UINT8, ImageBuf
from scipy import ndimage

from dsis.cfa import Cfa, mosaic, pattern
from dsis.demosaic import METHODS, bilinear, demosaic
from dsis.demosaic.lu_tan import lu_tan

BAYER = [cfa for cfa in Cfa if cfa is not Cfa.MONO]
POST_PROCESSED = "lu_tan, post-processed"
BORDER = 12  # samples further inside see nothing of the border

EPS = 2.0**-24  # relative error of one rounding to float32
# Rounding a difference of samples changes a weight 1/(code + differences) of Lu and Tan, or a
# variance beside e = 0.1 codes squared of DLMMSE, by at most 255 EPS of itself, and so the weighted
# mean by that part of the range. (Measured: 45 and 7 EPS.)
ERROR = {"bilinear": 4 * EPS, "dlmmse": 255 * EPS, "lu_tan": 255 * EPS, POST_PROCESSED: 255 * EPS}


def run(name, samples, cfa, **options):
    if name == POST_PROCESSED:
        return lu_tan(samples, cfa, post_process=True, **options)
    return demosaic(samples, cfa, name, **options)


def noise(*shape, seed=1):
    return np.random.default_rng(seed).standard_normal(shape).astype(np.float32)


# The equations once more: float64, whole frames, no thought of speed.


def reflected(samples, cfa):
    """Return the mosaic and the masks of red, green and blue, 16 sites beyond the borders."""
    rows, columns = samples.shape
    colours = np.tile(pattern(cfa), (rows // 2 + 1, columns // 2 + 1))[:rows, :columns]
    padded = np.pad(colours, 16, mode="reflect")
    return np.pad(samples.astype(float), 16, mode="reflect"), [padded == c for c in range(3)]


def at(plane, di, dj):
    return np.roll(plane, (-di, -dj), (0, 1))


def bilinear_reference(samples, cfa, _full_scale):
    m, masks = reflected(samples, cfa)
    quarter = np.array([[1, 2, 1], [2, 4, 2], [1, 2, 1]]) / 4
    half = np.array([[0, 1, 0], [1, 4, 1], [0, 1, 0]]) / 4
    planes = [ndimage.convolve(m * masks[c], half if c == 1 else quarter) for c in range(3)]
    return np.stack(planes, axis=-1)[16:-16, 16:-16]


def dlmmse_reference(samples, cfa, full_scale):
    m, (red, green, blue) = reflected(samples, cfa)
    e = 0.1 * (full_scale / 255) ** 2
    x, v = [], []
    for axis in (1, 0):
        f = ndimage.correlate1d(m, [-0.25, 0.5, 0.5, 0.5, -0.25], axis)
        d = np.where(green, m - f, f - m)
        s = ndimage.correlate1d(d, np.array([4, 9, 15, 23, 26, 23, 15, 9, 4]) / 128, axis)
        window = [np.roll(s, k, axis) for k in range(-4, 5)]
        p = np.var(window, axis=0, ddof=1)
        r = np.mean([np.roll((s - d) ** 2, k, axis) for k in range(-4, 5)], axis=0) + e
        x.append(s + p / (p + r) * (d - s))
        v.append(p - p**2 / (p + r) + e)
    own = (v[1] * x[0] + v[0] * x[1]) / (v[0] + v[1])
    planes = []
    for here, there in ((red, blue), (blue, red)):
        g_minus_c = np.where(here, own, 0)
        diagonal = sum(at(g_minus_c, i, j) for i in (-1, 1) for j in (-1, 1)) / 4
        g_minus_c = np.where(there, diagonal, g_minus_c)
        axial = sum(at(g_minus_c, *to) for to in ((0, 1), (0, -1), (1, 0), (-1, 0))) / 4
        planes.append(np.where(green, axial, g_minus_c))
    g = np.where(green, m, m + own)
    return np.stack([g - planes[0], g, g - planes[1]], axis=-1)[16:-16, 16:-16]


def lu_tan_reference(samples, cfa, full_scale):
    m, (red, green, blue) = reflected(samples, cfa)
    code = full_scale / 255
    axial, diagonal = [(0, 1), (0, -1), (1, 0), (-1, 0)], [(1, 1), (1, -1), (-1, 1), (-1, -1)]
    weights, estimates = [], []
    for i, j in axial:
        sides = abs(at(m, j, i) - at(m, j + 2 * i, i + 2 * j))
        sides += abs(at(m, -j, -i) - at(m, -j + 2 * i, -i + 2 * j))
        gradient = abs(at(m, -i, -j) - at(m, i, j)) + abs(at(m, i, j) - at(m, 3 * i, 3 * j))
        gradient += abs(m - at(m, 2 * i, 2 * j)) + sides / 2
        weights.append(1 / (code + gradient))
        estimates.append(at(m, i, j) + (m - at(m, 2 * i, 2 * j)) / 2)
    g = np.where(green, m, np.average(estimates, axis=0, weights=weights))

    def interpolated(c, directions):
        weights, differences = [], []
        for i, j in directions:
            gradient = abs(at(c, i, j) - at(c, -i, -j)) + abs(m - at(m, 2 * i, 2 * j))
            weights.append(1 / (code + gradient + abs(g - at(g, i, j))))
            differences.append(at(c, i, j) - at(g, i, j))
        return g + np.average(differences, axis=0, weights=weights)

    planes = []
    for here, there in ((red, blue), (blue, red)):
        c = np.where(here, m, 0)
        c = np.where(there, interpolated(c, diagonal), c)
        planes.append(np.where(green, interpolated(c, axial), c))
    return np.stack([planes[0], g, planes[1]], axis=-1)[16:-16, 16:-16]


def post_processed_reference(samples, cfa, full_scale):
    image = lu_tan_reference(samples, cfa, full_scale)
    rows, columns = samples.shape
    for i in range(rows):
        for j in range(columns):
            near_i = [mirrored(k, rows) for k in (i - 1, i, i + 1)]
            near_j = [mirrored(k, columns) for k in (j - 1, j, j + 1)]
            block = image[np.ix_(near_i, near_j)]
            to_red = np.median(block[..., 1] - block[..., 0])
            to_blue = np.median(block[..., 1] - block[..., 2])
            g = (image[i, j, 0] + to_red + image[i, j, 2] + to_blue) / 2
            image[i, j] = g - to_red, g, g - to_blue
    return image


def mirrored(k, count):
    return abs(k) if k < count else 2 * count - 2 - k


REFERENCE = {
    "bilinear": bilinear_reference,
    "dlmmse": dlmmse_reference,
    "lu_tan": lu_tan_reference,
    POST_PROCESSED: post_processed_reference,
}


@given(
    name=st.sampled_from(list(REFERENCE)),
    cfa=st.sampled_from(BAYER),
    shape=st.tuples(st.integers(8, 23), st.integers(8, 23)),
    full_scale=st.sampled_from([1.0, 255.0, 64000.0]),
    content=st.tuples(st.sampled_from(["noise", "edges", "ramp"]), st.integers(0, 2**32 - 1)),
)
@settings(deadline=None, derandomize=True, max_examples=150)  # the first example compiles
def test_equals_its_equations_in_double_precision(name, cfa, shape, full_scale, content):
    kind, seed = content
    samples = np.random.default_rng(seed).uniform(-0.1, 1, shape)
    if kind == "edges":
        samples = np.round(samples)
    if kind == "ramp":
        samples = 0.1 + 0.8 * sum(np.indices(shape)) / sum(shape)
    samples = (samples * full_scale).astype(np.float32)
    expected = REFERENCE[name](samples, cfa, full_scale)
    got = run(name, samples, cfa, **{} if name == "bilinear" else {"full_scale": full_scale})
    np.testing.assert_allclose(got, expected, rtol=0, atol=ERROR[name] * full_scale)


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize("cfa", BAYER)
def test_equals_its_equations_over_several_tiles(name, cfa):
    samples = np.random.default_rng(2).random((141, 523), np.float32)
    expected = REFERENCE[name](samples, cfa, 1.0)
    np.testing.assert_allclose(demosaic(samples, cfa, name), expected, rtol=0, atol=ERROR[name])


# Published figures.


@pytest.fixture(scope="module")
def kodak(shared_data):
    files = sorted((shared_data / "kodak").glob("kodim*.png"))
    assert len(files) == 24
    return [ImageBuf(str(file)).get_pixels(UINT8)[..., :3] for file in files]


@pytest.mark.parametrize(
    ("name", "published_db", "tolerance_db"),
    [
        ("bilinear", 30.24, 0.02),
        ("dlmmse", 40.16, 0.03),
        ("lu_tan", 39.10, 0.03),
        (POST_PROCESSED, 39.62, 0.05),
    ],
)
def test_quality_on_the_kodak_images(name, published_db, tolerance_db, kodak):
    psnr_db = []
    for image in kodak:
        samples = mosaic(image.astype(np.float32), Cfa.RGGB)
        options = {} if name == "bilinear" else {"full_scale": 255.0}
        codes = np.clip(np.rint(run(name, samples, Cfa.RGGB, **options)), 0, 255)
        error = (codes - image)[10:-10, 10:-10]
        psnr_db.append(10 * np.log10(255**2 / np.mean(np.square(error, dtype=float))))
    assert np.mean(psnr_db) == pytest.approx(published_db, abs=tolerance_db)


# White noise through the bilinear filter: its kernels' autocorrelation, averaged over the phase.
CORRELATION = {
    (0, 1): 4 / 7, (0, 2): 1 / 8, (1, 0): 4 / 7, (1, 1): 9 / 28,
    (1, 2): 1 / 14, (2, 0): 1 / 8, (2, 1): 1 / 14, (2, 2): 1 / 56,
}  # fmt: skip


@pytest.mark.parametrize("cfa", BAYER)
def test_bilinear_correlates_white_noise_as_its_kernels_say(cfa):
    # Each field gives one value of a statistic that has mean 0 if the fraction is right: lagged
    # products minus fraction times squares, over whole 2 x 2 cells, all channels. The standard
    # error is that of a mean over the independent fields.
    fields = [demosaic(noise(134, 134, seed=seed), cfa, "bilinear") for seed in range(64)]
    n = slice(2, 130)
    for (k, lag), fraction in CORRELATION.items():
        shifted = slice(2 + k, 130 + k), slice(2 + lag, 130 + lag)
        excess = [np.mean(f[n, n] * f[shifted] - fraction * f[n, n] ** 2) for f in fields]
        assert abs(z_score(excess)) < 4, (k, lag)
    for channel, factor in enumerate((9 / 16, 5 / 8, 9 / 16)):
        excess = [np.mean(f[n, n, channel] ** 2) - factor for f in fields]
        assert abs(z_score(excess)) < 4, channel


def z_score(values):
    return np.mean(values) / (np.std(values, ddof=1) / np.sqrt(len(values)))


# Properties.


@pytest.mark.parametrize("name", REFERENCE)
@pytest.mark.parametrize("cfa", BAYER)
def test_constant_colours_are_kept_up_to_the_border(name, cfa):
    scene = np.full((17, 20, 3), (0.25, 0.5, 0.75), np.float32)
    got = run(name, mosaic(scene, cfa), cfa)
    np.testing.assert_allclose(got, scene, rtol=0, atol=8 * EPS)


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize("cfa", BAYER)
def test_linear_ramps_are_kept_inside(name, cfa):
    row, column = np.indices((50, 47))
    planes = [0.3 + 0.002 * row - 0.001 * column, 0.1 + 0.005 * column, 0.9 - 0.004 * row]
    scene = np.stack(planes, axis=-1).astype(np.float32)
    got = demosaic(mosaic(scene, cfa), cfa, name)
    inside = slice(BORDER, -BORDER)
    # Samples rounded to float32 have second differences of a few EPS, which opposite directions
    # average; no weight amplifies them, as all directions agree.
    np.testing.assert_allclose(got[inside, inside], scene[inside, inside], rtol=0, atol=12 * EPS)


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize("cfa", BAYER)
def test_samples_of_the_mosaic_are_kept(name, cfa):
    samples = noise(73, 268)
    np.testing.assert_array_equal(mosaic(demosaic(samples, cfa, name), cfa), samples)


SYMMETRIES = {
    "rows reversed": lambda a: a[::-1],
    "columns reversed": lambda a: a[:, ::-1],
    "transposed": lambda a: a.swapaxes(0, 1),
}


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize("cfa", BAYER)
@pytest.mark.parametrize("symmetry", SYMMETRIES)
@pytest.mark.parametrize("shape", [(70, 66), (33, 301)])
def test_no_direction_is_preferred(name, cfa, symmetry, shape):
    turned = SYMMETRIES[symmetry]
    colours = np.tile(pattern(cfa), (shape[0] // 2 + 1, shape[1] // 2 + 1))
    corner = turned(colours[: shape[0], : shape[1]])[:2, :2]
    turned_cfa = Cfa("".join("RGB"[c] for c in corner.ravel()))
    samples = noise(*shape)
    got = demosaic(turned(samples), turned_cfa, name)
    # Bit for bit: mirrored terms are added in pairs.
    np.testing.assert_array_equal(got, turned(demosaic(samples, cfa, name)))


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize("offset", [(40, 60), (41, 60), (40, 61), (41, 61)])
def test_a_crop_inside_is_the_crop_of_the_result(name, offset):
    samples = noise(200, 320)
    row, column = offset
    cfa = BAYER[0]
    cropped_cfa = Cfa("".join("RGB"[c] for c in np.roll(pattern(cfa), offset, (0, 1)).ravel()))
    whole = demosaic(samples, cfa, name)[row : row + 120, column : column + 200]
    part = demosaic(samples[row : row + 120, column : column + 200], cropped_cfa, name)
    inside = slice(BORDER, -BORDER)
    np.testing.assert_array_equal(part[inside, inside], whole[inside, inside])


@pytest.mark.parametrize("name", REFERENCE)
def test_scaling_the_mosaic_scales_the_result(name):
    samples = noise(40, 50)
    scale = {} if name == "bilinear" else {"full_scale": 4096.0}
    expected = 4096 * run(name, samples, Cfa.GRBG)  # a power of two: exact
    np.testing.assert_array_equal(run(name, 4096 * samples, Cfa.GRBG, **scale), expected)


@pytest.mark.parametrize("name", REFERENCE)
@pytest.mark.parametrize("threads", [2, 3])
def test_threads_change_no_byte(name, threads):
    samples = noise(331, 300)
    alone = run(name, samples, Cfa.GBRG)
    assert run(name, samples, Cfa.GBRG, threads=threads).tobytes() == alone.tobytes()


@given(
    cfa=st.sampled_from(BAYER),
    shape=st.tuples(st.integers(8, 12), st.one_of(st.integers(8, 24), st.integers(25, 90))),
    offset=st.integers(0, 16),
    past_the_cache=st.booleans(),
)
@settings(deadline=None, derandomize=True, max_examples=60)  # the first example compiles
def test_bilinear_writes_the_same_anywhere_in_memory(cfa, shape, offset, past_the_cache):
    samples = noise(*shape)
    size = 3 * samples.size
    space = np.full(size + 40, np.nan, np.float32)
    out = space[offset : offset + size].reshape(*shape, 3)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(bilinear, "_CACHED_BYTES", 0 if past_the_cache else 1 << 40)
        demosaic(samples, cfa, "bilinear", out=out)
    expected = bilinear_reference(samples, cfa, 1.0)
    error = ERROR["bilinear"] * np.abs(samples).max()
    np.testing.assert_allclose(out, expected, rtol=0, atol=error)
    assert np.isnan(space[:offset]).all()
    assert np.isnan(space[offset + size :]).all()


# Arguments.


@pytest.mark.parametrize("name", METHODS)
def test_writes_into_the_array_given(name):
    samples, out = noise(20, 30), np.full((20, 30, 3), np.nan, np.float32)
    assert demosaic(samples, Cfa.RGGB, name, out=out) is out
    np.testing.assert_array_equal(out, demosaic(samples, Cfa.RGGB, name))


@pytest.mark.parametrize("name", METHODS)
def test_takes_read_only_and_strided_mosaics_and_leaves_them(name):
    samples = noise(20, 30)
    expected = demosaic(samples, Cfa.RGGB, name)
    strided = np.asfortranarray(samples)
    strided.flags.writeable = False
    np.testing.assert_array_equal(demosaic(strided, Cfa.RGGB, name), expected)
    np.testing.assert_array_equal(strided, noise(20, 30))


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize(
    ("samples", "cfa", "options", "words"),
    [
        (noise(7, 8), Cfa.RGGB, {}, "7 x 8, must be at least 8 x 8"),
        (noise(9, 9), Cfa.MONO, {}, "cfa is MONO"),
        (noise(9, 9).astype(np.float64), Cfa.RGGB, {}, "float64 .*must be float32"),
        (noise(9, 9, 3), Cfa.RGGB, {}, "must be float32 .row, column."),
        (noise(9, 9), Cfa.RGGB, {"out": np.empty((9, 9, 4), np.float32)}, "out is .*9, 9, 3"),
        (noise(9, 9), Cfa.RGGB, {"out": np.empty((3, 9, 9), np.float32).T}, "C-contiguous"),
    ],
)
def test_refuses_what_it_cannot_demosaic(name, samples, cfa, options, words):
    with pytest.raises(ValueError, match=words):
        demosaic(samples, cfa, name, **options)


def test_refuses_an_unknown_method_a_wrong_scale_and_an_overlap():
    samples = noise(9, 9)
    with pytest.raises(ValueError, match="'amaze', must be one of bilinear, dlmmse, lu_tan"):
        demosaic(samples, Cfa.RGGB, "amaze")
    for full_scale in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(ValueError, match="full_scale"):
            demosaic(samples, Cfa.RGGB, "dlmmse", full_scale=full_scale)
        with pytest.raises(ValueError, match="full_scale"):
            demosaic(samples, Cfa.RGGB, "lu_tan", full_scale=full_scale)
    bytes_between = np.zeros(4 * 243 + 1, np.uint8)[1:].view(np.float32).reshape(9, 9, 3)
    with pytest.raises(ValueError, match="aligned"):
        demosaic(samples, Cfa.RGGB, "bilinear", out=bytes_between)
    image = noise(9, 9, 3)
    with pytest.raises(ValueError, match="overlaps"):
        demosaic(image[..., 0], Cfa.RGGB, "bilinear", out=image)
