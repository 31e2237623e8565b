"""Every textual claim of the paper: as printed, from its printed table, and here."""

from dataclasses import dataclass
from pathlib import Path

from analysis.paper.denoised import Found, compared, measure
from analysis.paper.fig6 import MARK, Scores, scores
from analysis.paper.part import Part, Table, number
from analysis.paper.published import MOS_LOSS, REMOVED_SHARE, TABLE_2
from analysis.paper.setting import Setting

HEADER = ("claim", "printed", "from its printed table", "here", "on our content", "remark")
METHOD = "bilinear"
NEAR_DB = 1.0  # as printed: within this
NEAR_GRADES = 0.5


@dataclass(frozen=True)
class Claim:
    """A sentence of the paper.

    Attributes
    ----------
    says
        In the paper's words, or nearly.
    printed, table, ours
        The number in the text, the same from the paper's own table, and ours; None: there is none.
    holds
        Whether ours bears it out; None: cannot be told.
    unit, remark
        As in a `Row`.
    """

    says: str
    printed: str
    table: str
    ours: str
    holds: bool | None
    remark: str = ""

    def cells(self) -> tuple[str, ...]:
        """Return the claim as text, in the order of `HEADER`."""
        verdict = {True: "holds", False: "does not hold", None: "cannot be told"}[self.holds]
        return (self.says, self.printed, self.table, self.ours, verdict, self.remark)


def recompute(setting: Setting, folder: Path) -> Part:
    """Check every sentence with a number, or that a number can decide."""
    found = measure(setting, folder)
    checks = (_loss, _gains, _domains, _effect)
    alike = compared(found, setting)
    claims = [claim for check in checks for claim in check(found, alike)] + _votes(setting)
    rows = tuple(claim.cells() for claim in claims)
    table = Table("claims", "What the paper says in words", HEADER, rows)
    held = sum(claim.holds is True for claim in claims)
    told = sum(claim.holds is not None for claim in claims)
    says = (
        f"{held} of {told} claims that can be decided without people hold on our City, with our "
        "denoisers and bilinear demosaicking; a direction counts as held whatever its size, a "
        f"number if it is met within {NEAR_DB:g} dB. 'Against demosaicked clean' leaves out the "
        "error that demosaicking makes without any noise, which our City has more of than the "
        "paper's, whose demosaicked frames come out better than its full-colour ones."
    )
    return Part("claims", "What the paper says, and what holds", (says,), (), (), (table,))


def _db(value: float) -> str:
    return f"{number(value, 3) if abs(value) < 1 else f'{value:.2f}'} dB".replace("-", "\u2212")


def _printed(noise: str, stage: int, name: str, at: int) -> float:
    return TABLE_2[noise, stage][name][at]


def _cell(found: Found, noise: str, stage: int, name: str, at: int) -> float:
    return found[noise, stage, ("none", METHOD)[at], name, False].mean_db


def _loss(found: Found, alike: Found) -> list[Claim]:
    """Check the loss of up to 8 dB by demosaicking."""
    cases = [(n, s, d) for n, s in TABLE_2 for d in ("bls_gsm", "bm3d")]
    theirs = max(_printed(*case, 0) - _printed(*case, 1) for case in cases)
    ours = max(_cell(found, *case, 0) - _cell(found, *case, 1) for case in cases)
    without = max(
        alike[n, s, "none", d, False].mean_db - alike[n, s, METHOD, d, False].mean_still_db
        for n, s, d in cases
    )
    says = "The PSNR of denoised images is up to 8 dB lower when demosaicking is included"
    remark = f"against demosaicked clean: {_db(without)}"
    return [Claim(says, "8 dB", _db(theirs), _db(ours), ours >= 8 - NEAR_DB, remark)]


def _gains(found: Found, alike: Found) -> list[Claim]:
    """Compare what BM3D gains without and with demosaicking."""
    claims = []
    cases = (("awgn", 3), ("sd", 3))
    theirs = [_printed(*c, "bm3d", 0) - _printed(*c, "noisy", 0) for c in cases]
    ours = [_cell(found, *c, "bm3d", 0) - _cell(found, *c, "noisy", 0) for c in cases]
    claims.append(
        Claim(
            "BM3D improves both kinds of noise by above 10 dB (RGB)",
            "10 dB",
            f"{_db(theirs[0])} AWGN, {_db(theirs[1])} SD",
            f"{_db(ours[0])} AWGN, {_db(ours[1])} SD",
            min(ours) > 10,
            "the more detail a picture has, the less there is to gain",
        )
    )
    for case, printed, name in zip(cases, (5.54, 2.82), ("AWGN", "SD"), strict=True):
        table = _printed(*case, "bm3d", 1) - _printed(*case, "noisy", 1)
        gain = _cell(found, *case, "bm3d", 1) - _cell(found, *case, "noisy", 1)
        still = [alike[*case, METHOD, d, False].mean_still_db for d in ("bm3d", "noisy")]
        claims.append(
            Claim(
                f"BM3D improves demosaicked {name} by only {printed} dB",
                f"{printed} dB",
                _db(table),
                _db(gain),
                abs(gain - printed) <= NEAR_DB,
                "text and printed table exchange the two kinds of noise; against demosaicked "
                f"clean: {_db(still[0] - still[1])}",
            )
        )
    lower = [
        (_cell(found, *c, "bm3d", 0) - _cell(found, *c, "noisy", 0))
        > (_cell(found, *c, "bm3d", 1) - _cell(found, *c, "noisy", 1))
        for c in cases
    ]
    says = "BM3D is sensitive to spatially correlated noise: it gains much less after demosaicking"
    gains = [_printed(*c, "bm3d", 1) - _printed(*c, "noisy", 1) for c in cases]
    after = [_cell(found, *c, "bm3d", 1) - _cell(found, *c, "noisy", 1) for c in cases]
    claims.append(
        Claim(
            says,
            "much smaller",
            f"{_db(theirs[0])} to {_db(gains[0])} AWGN, {_db(theirs[1])} to {_db(gains[1])} SD",
            f"{_db(ours[0])} to {_db(after[0])} AWGN, {_db(ours[1])} to {_db(after[1])} SD",
            all(lower),
        )
    )
    return claims


def _domains(found: Found, alike: Found) -> list[Claim]:
    """Compare linear and display domain for each denoiser."""
    claims = []
    for name, says, sign in (
        ("bls_gsm", "BLS-GSM works better in linear domain", 1),
        ("bm3d", "BM3D works better in display domain", -1),
    ):
        theirs = [_printed("sd", 2, name, at) - _printed("sd", 3, name, at) for at in (0, 1)]
        ours = [_cell(found, "sd", 2, name, at) - _cell(found, "sd", 3, name, at) for at in (0, 1)]
        table_holds = [sign * value > 0 for value in theirs]
        remark = "linear less display"
        if not all(table_holds):
            remark += "; the printed table bears it out for RGB only"
        claims.append(
            Claim(
                says,
                "better",
                f"{_db(theirs[0])} RGB, {_db(theirs[1])} dem.",
                f"{_db(ours[0])} RGB, {_db(ours[1])} dem.",
                all(sign * value > 0 for value in ours),
                remark,
            )
        )
    theirs = [_printed("sd", 3, "bls_gsm", at) - _printed("sd", 3, "noisy", at) for at in (0, 1)]
    white = _printed("awgn", 3, "bls_gsm", 0) - _printed("awgn", 3, "noisy", 0)
    ours_sd, ours_white = (
        _cell(found, n, 3, "bls_gsm", 0) - _cell(found, n, 3, "noisy", 0) for n in ("sd", "awgn")
    )
    claims.append(
        Claim(
            "BLS-GSM improves signal-dependent noise less than white noise (RGB, display)",
            "lower",
            f"{_db(theirs[0])} SD, {_db(white)} AWGN",
            f"{_db(ours_sd)} SD, {_db(ours_white)} AWGN",
            ours_sd < ours_white,
            "the signal-dependent noise is 4 dB stronger, in the paper too: there is more to gain",
        )
    )
    theirs = [_printed("sd", 3, "bls_gsm", at) for at in (0, 1)]
    ours = [_cell(found, "sd", 3, "bls_gsm", at) for at in (0, 1)]
    still = alike["sd", 3, METHOD, "bls_gsm", False].mean_still_db
    still -= _cell(alike, "sd", 3, "bls_gsm", 0)
    claims.append(
        Claim(
            "After BLS-GSM in display domain, demosaicked signal-dependent noise has a slightly "
            "higher PSNR than RGB",
            "higher",
            f"{_db(theirs[1] - theirs[0])}",
            f"{_db(ours[1] - ours[0])}",
            ours[1] > ours[0],
            f"against demosaicked clean: {_db(still)}",
        )
    )
    return claims


def _effect(found: Found, alike: Found) -> list[Claim]:
    """Check the slight denoising effect of demosaicking."""
    claims = []
    for noise, name in (("sd", "signal-dependent noise"), ("awgn", "AWGN")):
        theirs = _printed(noise, 3, "noisy", 1) - _printed(noise, 3, "noisy", 0)
        ours = _cell(found, noise, 3, "noisy", 1) - _cell(found, noise, 3, "noisy", 0)
        alone = alike[noise, 3, METHOD, "noisy", False].mean_still_db
        alone -= _cell(alike, noise, 3, "noisy", 0)
        claims.append(
            Claim(
                f"Demosaicking has a slight denoising effect on {name} (here: on the noise alone)",
                "higher PSNR",
                _db(theirs),
                f"{_db(alone)} against demosaicked clean",
                alone > 0,
                f"against the full-colour reference {_db(ours)}: there the error of "
                "demosaicking itself outweighs it",
            )
        )
    return claims


def _votes(setting: Setting) -> list[Claim]:
    """Check what the paper says of its observers."""
    found = scores(setting)
    mark = MARK if found.simulated_share > 0 else ""
    says = "4.6 % of all votes lie beyond 2 sigma and were removed"
    share = f"{100 * found.removed_share:.1f} %"
    decided = None if mark else abs(found.removed_share - REMOVED_SHARE) < 0.02
    remark = "; ".join(p for p in (mark, "a normal distribution has 4.6 % beyond 2 sigma") if p)
    claims = [Claim(says, "4.6 %", "votes are not public", share, decided, remark)]
    claims += [_lost(found, *key, printed, mark) for key, printed in MOS_LOSS.items()]
    return [*claims, _all_lower(found, mark)]


def _all_lower(found: Scores, mark: str) -> Claim:
    pairs = found.table[["content", "noise"]].drop_duplicates().itertuples(index=False)
    losses = [loss[0] for content, noise in pairs if (loss := found.loss(content, noise))]
    lower = sum(loss > 0 for loss in losses)
    holds = None if mark or not losses else lower == len(losses)
    says = "All demosaicked sequences have a lower MOS than those without"
    return Claim(says, "all", "figure only", f"{lower} of {len(losses)}", holds, mark)


def _lost(found: Scores, content: str, noise: str, printed: float, mark: str) -> Claim:
    loss = found.loss(content, noise)
    ours = f"{loss[0]:.2f} ± {loss[1]:.2f}".replace("-", "\u2212") if loss else "no such pair"
    near = None
    if loss and not mark:
        near = abs(loss[0] - printed) <= max(NEAR_GRADES, 2 * loss[1])
    says = f"MOS of {content} with {noise.upper()} is {printed:g} lower with demosaicking"
    return Claim(says, f"{printed:g}", "figure only", ours, near, mark)
