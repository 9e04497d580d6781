"""A store folder that is full, missing, or has something else in a file's place is reported as such, at once."""

from __future__ import annotations

import errno
import logging
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import service.store
from service.errors import ServiceError
from service.store import Store
from tests.unit.service.test_store import sphere


@pytest.fixture(autouse=True)
def quiet(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.CRITICAL + 1, "service")


def code_of(action: Callable[[], Any]) -> str:
    with pytest.raises(ServiceError) as caught:
        action()
    return caught.value.code


@pytest.mark.parametrize(
    ("number", "code"),
    [(errno.ENOSPC, "store_full"), (errno.EDQUOT, "store_full"), (errno.EIO, "store_unavailable")],
)
def test_a_full_disk_is_no_failure_of_the_service(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int, code: str
) -> None:
    def refuse(_: int) -> None:
        raise OSError(number, os.strerror(number))

    store = Store(10**6, tmp_path)
    monkeypatch.setattr(service.store.os, "fsync", refuse)
    assert code_of(lambda: store.put(sphere(1))) == code
    assert not [*tmp_path.iterdir()]
    monkeypatch.undo()
    assert store.put(sphere(1))[1]


def test_a_folder_that_is_gone_is_told(tmp_path: Path) -> None:
    store = Store(10**6, tmp_path / "solids")
    name, _ = store.put(sphere(1))
    shutil.rmtree(tmp_path / "solids")
    assert code_of(lambda: store.put(sphere(2))) == "store_unavailable"
    assert store.get(name) is not None  # it is in memory
    assert code_of(lambda: store.get("0" * 64)) == "unknown_solid"


@pytest.mark.parametrize("make", [os.mkfifo, os.mkdir, lambda path: os.symlink("/dev/zero", path)])
def test_what_is_no_file_is_never_read(tmp_path: Path, make: Callable[[Path], None]) -> None:
    name, _ = Store(10**6).put(sphere(1))
    make(tmp_path / name)
    store = Store(10**6, tmp_path)
    assert code_of(lambda: store.get(name)) == "unknown_solid"
    if (tmp_path / name).is_dir():
        assert code_of(lambda: store.put(sphere(1))) == "store_unavailable"
    else:
        assert store.put(sphere(1)) == (name, True)
        assert Store(10**6, tmp_path).get(name) is not None


def test_another_users_file_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    name, _ = Store(10**6, tmp_path).put(sphere(1))

    def refuse(*_: object) -> int:
        raise PermissionError(errno.EACCES, "Permission denied")

    store = Store(10**6, tmp_path)
    monkeypatch.setattr(service.store.os, "open", refuse)
    assert code_of(lambda: store.get(name)) == "store_unavailable"
