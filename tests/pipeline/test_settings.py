"""Settings are checked once, when they are made."""

import pytest

from addon.pipeline.errors import UserError
from addon.pipeline.settings import PASSES, Settings


def test_the_defaults_ask_for_every_pass_once() -> None:
    assert sorted(Settings().passes) == sorted({"combined", "depth", "normal", "position", "triangle", "cost"})


@pytest.mark.parametrize("name", PASSES)
def test_any_pass_alone_will_do(name: str) -> None:
    assert Settings(passes=(name,)).passes == (name,)


@pytest.mark.parametrize(
    ("wrong", "named"),
    [
        ({"structure": "octree"}, "octree"),
        ({"precision": "sloppy"}, "sloppy"),
        ({"passes": ("combined", "albedo")}, "albedo"),
        ({"passes": ()}, "no pass"),
        ({"leaf_size": 0}, "leaf size is 0"),
        ({"threads": -1}, "threads is -1"),
        ({"samples": 0}, "samples is 0"),
        ({"seed": -1}, "seed is -1"),
        ({"overlay_depth": -1}, "overlay depth is -1"),
    ],
)
def test_a_wrong_value_is_named_as_wrong_usage(wrong: dict[str, object], named: str) -> None:
    with pytest.raises(UserError, match=named) as caught:
        Settings(**wrong)  # type: ignore[arg-type]
    assert caught.value.exit_status == 2
    assert "\n" not in str(caught.value)
