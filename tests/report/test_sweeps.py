"""The sweeps are what they are named after, at every k, and the same every time."""

from __future__ import annotations

import numpy as np
import pytest

from addon.report.sweeps import SWEEPS, Step

EVERY = [(name, k, np.float32) for name, sweep in SWEEPS.items() for k in sweep.ks]
EVERY += [(name, k, np.float64) for name, sweep in SWEEPS.items() for k in sweep.ks[::4]]


@pytest.mark.parametrize(("name", "k", "dtype"), EVERY)
def test_sound_and_the_same_every_time(name: str, k: int, dtype: type[np.floating]) -> None:
    step = SWEEPS[name].at(k, 60, dtype=dtype)
    for part, again in zip(step, SWEEPS[name].at(k, 60, dtype=dtype), strict=True):
        assert part.tobytes() == again.tobytes()
        assert np.isfinite(part).all()
    assert step.vertices.dtype == step.origins.dtype == step.directions.dtype == dtype
    assert step.triangles.dtype == np.uint32 and step.triangles.max() < len(step.vertices)
    assert step.origins.shape == step.directions.shape == (60, 3)
    assert step.directions.any(axis=1).all()


def size(step: Step) -> float:
    return float(np.ptp(step.vertices, axis=0).max())


@pytest.mark.parametrize("k", [0, 3, 7])
def test_what_grows(k: int) -> None:
    def at(name: str) -> Step:
        return SWEEPS[name].at(k, 300, dtype=np.float64)

    assert np.abs(at("offset").vertices[:, 0] - 10.0**k).max() <= 1
    assert np.linalg.norm(at("origin distance").origins, axis=1) == pytest.approx(2 * 10.0**k)
    step = at("sliver")
    corners = step.vertices[step.triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    assert area.max() < 4 * 10.0**-k
    step = at("scale ratio")
    assert size(step) == pytest.approx(1, rel=0.4)
    assert (np.abs(step.vertices).max(axis=1) < 2 * 10.0**-k).mean() > 0.3
    assert len(at("depth complexity").triangles) == 2**k
    step = at("direction")
    ratio = np.abs(step.directions).min(axis=1) / np.abs(step.directions).max(axis=1)
    assert np.isclose(ratio[np.arange(300) % 4 != 3], 10.0**-k, rtol=2).all() and not ratio[3::4].any()
    assert size(at("magnitude")) == 2 * 2.0**k


@pytest.mark.parametrize("k", [0, 2, 4, 6])
def test_the_angle_of_grazing_rays(k: int) -> None:
    step = SWEEPS["grazing"].at(k, 240, dtype=np.float64)
    corners = step.vertices[step.triangles][np.arange(240) % 12]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 4
    sine = np.abs((normal * step.directions).sum(axis=1)) / np.linalg.norm(step.directions, axis=1)
    assert np.allclose(sine, np.sin(np.arctan(10.0**-k)), rtol=1e-6)
