"""Votes in the JSON of the program sureal: `ref_videos`, and `dis_videos` with their votes."""

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pandas as pd

from analysis.scale import Scale
from analysis.votes import scored
from dsis.errors import Fault, InputError
from dsis.outdir import listed
from dsis.session.sureal import SIMULATED_OBSERVERS


def is_sureal(path: Path) -> bool:
    """Return whether a file is to be read as sureal's JSON."""
    return path.suffix.lower() == ".json"


def read_sureal(path: Path) -> pd.DataFrame:
    """Return the votes of a sureal dataset in JSON.

    `os` of a video is {observer: vote or list of votes}, or a list of votes, one an observer (these
    are then called o1, o2 ...); null is a vote not given. A video whose path is its content's
    reference video is a hidden reference. Stimuli are named by `asset_name`, else `path`, else by
    content and asset id. Observers whom the dataset lists as `simulated_observers`, a key of
    dsis that sureal passes over, are marked as simulated.

    Raises
    ------
    InputError
        It is no such dataset, or somebody without a vote is said to be simulated; every place that
        is wrong is named.
    """
    dataset = _load(path)
    contents, references = _contents(dataset)
    robots = set(_robots(dataset, path))
    faults: list[Fault] = []
    rows = []
    for at, video in enumerate(dataset["dis_videos"]):
        key = f"dis_videos[{at}]"
        if not isinstance(video, dict) or "os" not in video:
            faults.append(Fault(str(path), key, "has no votes (os)"))
            continue
        number = video.get("content_id")
        content = contents.get(number, "" if number is None else str(number))
        kind = "reference" if _is_reference(video, references) else "test"
        name = _name(video, content)
        try:
            rows += [
                (who, name, content, kind, repetition, vote, who in robots)
                for who, repetition, vote in _votes(video["os"])
            ]
        except ValueError as error:
            faults.append(Fault(str(path), f"{key}.os", str(error)))
    if faults:
        raise InputError(faults)
    if not rows:
        raise InputError.of(path, "dis_videos", "holds no votes")
    _check_robots(robots, list(dict.fromkeys(row[0] for row in rows)), path)
    columns = ["observer", "stimulus", "content", "kind", "repetition", "vote", "simulated"]
    return pd.DataFrame(rows, columns=columns).astype({"vote": "float64"})


def _load(path: Path) -> dict[str, Any]:
    try:
        dataset = json.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise InputError.of(path, "", f"cannot be read: {error.strerror}") from None
    except (ValueError, RecursionError) as error:
        raise InputError.of(path, "", f"is not JSON: {error}") from None
    if not isinstance(dataset, dict) or not isinstance(dataset.get("dis_videos"), list):
        fact = "is missing: a dataset of sureal has ref_videos and dis_videos"
        raise InputError.of(path, "dis_videos", fact)
    return dataset


def _contents(dataset: dict[str, Any]) -> tuple[dict[Any, str], dict[Any, Any]]:
    """Return the name and the path of the reference of each content id."""
    videos = [v for v in dataset.get("ref_videos", []) if isinstance(v, dict)]
    names = {v.get("content_id"): str(v.get("content_name", v.get("content_id"))) for v in videos}
    return names, {v.get("content_id"): v["path"] for v in videos if v.get("path")}


def _robots(dataset: dict[str, Any], path: Path) -> list[str]:
    """Return the observers that the dataset says are simulated."""
    names = dataset.get(SIMULATED_OBSERVERS, [])
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        fact = f"is {json.dumps(names)[:40]}, must be a list of observers"
        raise InputError.of(path, SIMULATED_OBSERVERS, fact)
    return names


def _check_robots(robots: set[str], observers: list[str], path: Path) -> None:
    """Refuse a mark that falls on nobody: somebody else's votes would pass for a person's."""
    strangers = sorted(robots - set(observers))
    if strangers:
        allowed = listed(observers) or "nobody"
        raise InputError(
            Fault(
                str(path),
                SIMULATED_OBSERVERS,
                f"names {json.dumps(name)[:40]}, must be of {allowed}",
            )
            for name in strangers
        )


def _is_reference(video: dict[str, Any], references: dict[Any, Any]) -> bool:
    return bool(video.get("path")) and references.get(video.get("content_id")) == video["path"]


def _name(video: dict[str, Any], content: str) -> str:
    given = video.get("asset_name") or video.get("path")
    return str(given) if given else f"{content}_{video.get('asset_id', '')}"


def _votes(scores: Any) -> Iterator[tuple[str, int, float]]:
    """Yield (observer, repetition, vote); `ValueError` says what is no vote."""
    if isinstance(scores, list):
        scores = {f"o{number}": score for number, score in enumerate(scores, 1)}
    if not isinstance(scores, dict):
        fact = f"is {json.dumps(scores)[:40]}, must be votes by observer"
        raise ValueError(fact)  # noqa: TRY004 - of the user's file, not of the caller
    for who, given in scores.items():
        for repetition, vote in enumerate(given if isinstance(given, list) else [given], 1):
            yield str(who), repetition, _number(who, vote)


def _number(who: Any, vote: Any) -> float:
    if vote is None or (isinstance(vote, float) and math.isnan(vote)):
        return math.nan
    if isinstance(vote, bool) or not isinstance(vote, int | float) or math.isinf(vote):
        fact = f"of {who} is {json.dumps(vote)[:40]}, must be a number"
        raise ValueError(fact)
    return float(vote)


def write_sureal(votes: pd.DataFrame, path: Path, scale: Scale, title: str = "dsis") -> None:
    """Write the scored votes as a sureal dataset; observers of several labs as `lab/observer`.

    sureal knows no missing second vote: repetitions stand in a list, null where one is missing.
    Its reader takes numbers only, so a test without missing repetitions reads back there as well.

    Raises
    ------
    InputError
        Some votes of an observer are simulated and some are not: a dataset marks observers.
    """
    rows = scored(votes)
    names = rows["observer"].where(rows["lab"] == "", rows["lab"] + "/" + rows["observer"])
    kinds = rows["simulated"].groupby(names).nunique()
    if (kinds > 1).any():
        fact = "has simulated votes and others: must be one of both, this file marks observers"
        raise InputError(Fault(str(path), str(who), fact) for who in kinds.index[kinds > 1])
    contents = {name: number for number, name in enumerate(sorted(set(rows["content"])))}
    videos = []
    references = {name: name for name in contents}
    by_stimulus = rows.assign(observer=names).groupby("stimulus", sort=True)
    for at, (stimulus, mine) in enumerate(by_stimulus):
        content = str(mine["content"].iloc[0])
        if mine["kind"].iloc[0] == "reference":
            references[content] = str(stimulus)
        videos.append(
            {
                "content_id": contents[content],
                "asset_id": at,
                "asset_name": str(stimulus),
                "path": str(stimulus),
                "os": {str(who): _listed(theirs) for who, theirs in mine.groupby("observer")},
            }
        )
    dataset = {
        "dataset_name": title,
        "yuv_fmt": "notyuv",
        "ref_score": scale.high,
        SIMULATED_OBSERVERS: sorted(set(names[rows["simulated"]])),
        "ref_videos": [
            {"content_id": number, "content_name": name, "path": references[name]}
            for name, number in contents.items()
        ],
        "dis_videos": videos,
    }
    text = json.dumps(dataset, indent=1, ensure_ascii=False) + "\n"
    path.write_text(text, encoding="utf-8", newline="")


def _listed(votes: pd.DataFrame) -> float | list[float | None]:
    by_repetition = dict(zip(votes["repetition"].tolist(), votes["vote"].tolist(), strict=True))
    last = max(by_repetition)
    listed = [by_repetition.get(k) for k in range(1, last + 1)]
    return float(votes["vote"].iloc[0]) if last == 1 else listed
