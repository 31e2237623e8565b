"""The spec as resolved, the digest of all that decides the bytes, and the manifest."""

import json
from importlib.metadata import version
from typing import Any

from dsis.camera import camera_values
from dsis.color import STUDIO_CONFIG
from dsis.manifest import Clip, Manifest
from dsis.spec import Test
from dsis.stimuli.journal import sha256
from dsis.stimuli.source import remarks_on


def build_digest(test: Test) -> str:
    """Return the digest of all that decides the bytes: spec, camera, footage, versions."""
    footage = {
        name: [(str(path), path.stat().st_size, path.stat().st_mtime_ns) for path in paths]
        for name, paths in test.footage.items()
    }
    sigma = sorted((name, level, value) for (name, level), value in test.sigma.items())
    everything = [spec_values(test), footage, sigma, _versions()]
    return sha256(json.dumps(everything, sort_keys=True).encode())


def spec_values(test: Test) -> dict[str, Any]:
    """Return the spec as resolved: the camera model in full, files with their whole paths."""
    values: dict[str, Any] = test.spec.model_dump(mode="json", by_alias=True, exclude_none=True)
    values["camera"] = camera_values(test.camera)
    for content in values["content"]:
        for key in ("files", "stills"):
            if key in content:
                content[key] = [str(test.folder / path) for path in content[key]]
    return values


def manifest_of(
    test: Test, clips: tuple[Clip, ...], sigmas: dict[str, dict[str, float]]
) -> Manifest:
    """Return the manifest of a test's clips; `sigmas` by content and level."""
    spec = test.spec
    return Manifest(
        schema="dsis-manifest/1",  # type: ignore[call-arg] # the alias, as files have it
        title=spec.title,
        sequence=spec.sequence,
        viewing=spec.viewing,
        session=spec.session,
        clips=clips,
        remarks=tuple(r for content in test.contents() for r in remarks_on(content, test)),
        spec=spec_values(test),
        awgn_sigma={name: per for name, per in sigmas.items() if per},
        versions=_versions(),
    )


def _versions() -> dict[str, str]:
    packages = ("dsis", "numpy", "scipy", "numba", "opencolorio", "OpenImageIO")
    return {
        "ocio_config": STUDIO_CONFIG,
        **{name: version(name) for name in packages},
    }
