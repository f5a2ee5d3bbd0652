"""The mistakes that tools/mutations.py makes are still to be found; `make mutations` makes them."""

from __future__ import annotations

import pytest

from tools.mutations import MUTATIONS, Mutation


@pytest.mark.parametrize("mutation", MUTATIONS, ids=lambda mutation: mutation.name)
def test_the_place_stands_once(mutation: Mutation) -> None:
    assert mutation.place() is None
    assert mutation.tests or mutation.unit_tests
