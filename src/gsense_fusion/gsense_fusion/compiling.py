"""numba's `njit` with a cache on the disk that knows its contents.

numba takes a cached kernel for fresh while the file of that kernel has not changed. The kernels that it calls, and the
constants that it uses, may stand in other files: after a change there, or an upgrade that replaces only some files, old
machine code would go on running. Here the cache's stamp is a digest of the kernel's bytecode, of the kernels that it
calls and of the constants that it names, so it is fresh exactly while the same code would be compiled again.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from types import CodeType
from typing import Any

from numba import njit
from numba.core.registry import CPUDispatcher

_DIGESTS: dict[Any, str] = {}
"""Kernel -> digest of all that its machine code rests on."""


def kernel(signature: str, *, allocates: bool = True) -> Callable[[Callable[..., Any]], Any]:
    """Compile a function for one signature, or take the machine code from the cache where nothing has changed.

    Args:
        signature: in numba's notation.
        allocates: whether it makes arrays. One that makes none needs no reference counts, which spares a call from
            Python 20 ns for each array that it is handed.

    Returns:
        A decorator; what it makes is called as the function is.
    """

    def compiled(function: Callable[..., Any]) -> Any:
        made = njit(function, _nrt=allocates)
        if not isinstance(made, CPUDispatcher):
            return made  # NUMBA_DISABLE_JIT
        _DIGESTS[made] = digest(function) + ("" if allocates else " without reference counts")
        made.enable_caching()
        # the one way that numba leaves to this: the stamp is compared with that in the index file before it is used
        made._cache._cache_file._source_stamp = _DIGESTS[made]  # noqa: SLF001
        made.compile(signature)
        made.disable_compile()
        return made

    return compiled


def digest(function: Callable[..., Any]) -> str:
    """Of all that the machine code of a function rests on."""
    code: CodeType = function.__code__
    lines = [_of_code(code)]
    for name in sorted(_names(code)):
        value = function.__globals__.get(name)
        if isinstance(value, CPUDispatcher):
            lines.append(f"{name} calls {_DIGESTS.get(value) or digest(value.py_func)}")
        elif isinstance(value, (bool, int, float, str, tuple)):
            lines.append(f"{name} = {value!r}")
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()


def _of_code(code: CodeType) -> str:
    constants = [_of_code(c) if isinstance(c, CodeType) else repr(c) for c in code.co_consts]
    return f"{code.co_code.hex()} {constants} {code.co_names} {code.co_varnames} {code.co_freevars}"


def _names(code: CodeType) -> set[str]:
    inner = [_names(c) for c in code.co_consts if isinstance(c, CodeType)]
    return set(code.co_names).union(*inner)
