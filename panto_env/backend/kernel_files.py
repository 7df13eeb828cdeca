"""Files of compiled kernels, each behind a check of itself: damaged machine code is never run."""

from __future__ import annotations

import hashlib
import pickle
import warnings
from pathlib import Path
from typing import Any

from numba.core.caching import IndexDataCacheFile

LENGTH = hashlib.sha256().digest_size


class CheckedFiles(IndexDataCacheFile):  # type: ignore[misc]
    """Numba's index and data of a kernel, where what is damaged counts as not there and is written anew."""

    def _load_index(self) -> dict[Any, str]:
        data = _read(self._index_path)
        if data is None:
            return {}
        version, stamp, overloads = pickle.loads(data)
        fresh = version == self._version and stamp == self._source_stamp
        return overloads if fresh else {}

    def _save_index(self, overloads: dict[Any, str]) -> None:
        self._write(self._index_path, (self._version, self._source_stamp, overloads))

    def _load_data(self, name: str) -> Any:
        data = _read(self._data_path(name))
        if data is None:
            raise FileNotFoundError(name)  # Numba then compiles, and saves under the same name
        return pickle.loads(data)

    def _save_data(self, name: str, data: Any) -> None:
        self._write(self._data_path(name), data)

    def _write(self, path: str, content: Any) -> None:
        data = self._dump(content)
        with self._open_for_write(path) as file:
            file.write(hashlib.sha256(data).digest() + data)


def _read(path: str) -> bytes | None:
    """What a file holds, without its check; None where there is none or it is damaged."""
    try:
        data = Path(path).read_bytes()
    except OSError:
        return None
    return data[LENGTH:] if hashlib.sha256(data[LENGTH:]).digest() == data[:LENGTH] else None


def check_files(cache: Any) -> None:
    """Let a kernel's cache of Numba's keep checked files, and go on without where they cannot be written."""
    plain, save = cache._cache_file, cache.save_overload  # what Numba has made for itself
    cache._cache_file = CheckedFiles(cache.cache_path, cache._impl.filename_base, plain._source_stamp)

    def save_if_possible(signature: Any, result: Any) -> None:
        try:
            save(signature, result)
        except OSError as error:
            warnings.warn(
                f"Compiled kernels cannot be kept in {cache.cache_path} ({error.strerror or error}), so the "
                "next process compiles them again; make room there, or set PANTO_CACHE_DIR.",
                RuntimeWarning,
                stacklevel=2,
            )

    cache.save_overload = save_if_possible
