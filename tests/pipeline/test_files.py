"""A file of output is whole or not there."""

from pathlib import Path

import pytest

from addon.pipeline.errors import UserError
from addon.pipeline.files import check_target, written_beside


def test_a_finished_file_takes_the_place_of_the_old_one_and_nothing_else_is_left(tmp_path: Path) -> None:
    target = tmp_path / "out.txt"
    target.write_text("old")
    with written_beside(target) as beside:
        beside.write_text("new")
        assert target.read_text() == "old"
        assert beside.suffix == target.suffix
        assert beside.parent == target.parent
    assert target.read_text() == "new"
    assert list(tmp_path.iterdir()) == [target]


@pytest.mark.parametrize("failure", [OSError(28, "No space left on device"), OSError("codec\nfailed"), KeyError("bug")])
def test_a_failure_midway_leaves_the_folder_as_it_was(tmp_path: Path, failure: Exception) -> None:
    target = tmp_path / "out.txt"
    target.write_text("old")
    named = {28: "out.txt: No space left on device"}.get(getattr(failure, "errno", None) or 0, "codec failed|bug")

    def fail() -> None:
        with written_beside(target) as beside:
            beside.write_text("half")
            raise failure

    with pytest.raises(UserError if isinstance(failure, OSError) else KeyError, match=named):
        fail()
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]


def test_targets_that_cannot_be_written(tmp_path: Path) -> None:
    check_target(tmp_path / "new.png")
    with pytest.raises(UserError, match=r"there is no folder .*missing") as caught:
        check_target(tmp_path / "missing" / "new.png")
    assert caught.value.exit_status == 1
    with pytest.raises(UserError, match="it is a folder"):
        check_target(tmp_path)
    (tmp_path / "file").touch()
    with pytest.raises(UserError, match="there is no folder"):
        check_target(tmp_path / "file" / "new.png")
