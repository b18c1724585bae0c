"""Message definitions: those of Jazzy, and gsense_msgs' own from where they are installed."""

from __future__ import annotations

import os
from functools import lru_cache
from pathlib import Path

from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

PACKAGE = "gsense_msgs"
_SOURCE_TREE = Path(__file__).resolve().parents[3] / PACKAGE


class DefinitionError(RuntimeError):
    """A message definition that is needed cannot be found; the message says what to do."""


def definition_folder(package: str) -> Path | None:
    """`share/<package>/msg` in the first prefix of the ament index that has it."""
    for prefix in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep):
        folder = Path(prefix) / "share" / package / "msg"
        if prefix and folder.is_dir():
            return folder
    return None


@lru_cache(maxsize=1)
def typestore() -> Typestore:
    """Jazzy's types and gsense_msgs'; raises DefinitionError where the latter are not installed."""
    store = get_typestore(Stores.ROS2_JAZZY)
    folder = definition_folder(PACKAGE)
    if folder is None and (_SOURCE_TREE / "msg").is_dir():
        folder = _SOURCE_TREE / "msg"
    if folder is None:
        raise DefinitionError(f"no message definitions of {PACKAGE}: source the workspace (./rig shell) first")
    register_folder(store, PACKAGE, folder)
    return store


def register_folder(store: Typestore, package: str, folder: Path) -> None:
    """Adds every .msg file of an installed package."""
    for file in sorted(folder.glob("*.msg")):
        store.register(get_types_from_msg(file.read_text(encoding="utf-8"), f"{package}/msg/{file.stem}"))


def knows(store: Typestore, msgtype: str) -> bool:
    """Whether a type is in the store, after a look into the ament index for its package."""
    if msgtype in store.fielddefs:
        return True
    package = msgtype.split("/", maxsplit=1)[0]
    folder = definition_folder(package)
    if folder is not None:
        register_folder(store, package, folder)
    return msgtype in store.fielddefs
