# Sourced by ./rig: which Python makes the environment.

# fail LINE: one line on stderr, exit 2
fail() {
    echo "gsense: $1" >&2
    exit 2
}

# Exit 0: version supported, venv and C headers are there. 1: supported, something is missing. 2: not supported.
probe_python() {
    "$1" -E -s -S - 2>/dev/null <<'END'
import sys
if not (3, 10) <= sys.version_info[:2] <= (3, 13):
    sys.exit(2)
import importlib.util, os, sysconfig
parts = all(importlib.util.find_spec(name) for name in ("venv", "ensurepip"))
sys.exit(0 if parts and os.path.exists(os.path.join(sysconfig.get_paths()["include"], "Python.h")) else 1)
END
}

# find_python: print the first interpreter that has all, else the first of a supported version
find_python() {
    local candidate second="" status
    for candidate in ${GSENSE_PYTHON:-/usr/bin/python3 python3 python3.12 python3.11 python3.13 python3.10}; do
        type -P "$candidate" >/dev/null || continue
        status=0
        probe_python "$candidate" || status=$?
        if [[ $status == 0 ]]; then
            type -P "$candidate"
            return
        fi
        [[ $status == 1 && -z $second ]] && second=$(type -P "$candidate")
    done
    [[ -n $second ]] || fail "gsense needs Python 3.10 to 3.13: sudo apt install python3 python3-venv python3-dev"
    echo "$second"
}

# preparing_python ROOT: the environment's own Python where it works (it starts fastest), else a found one
preparing_python() {
    local own=$1/.rig/env/bin/python
    if [[ -x $own && -e $1/.rig/stamps/environment ]]; then echo "$own"; else find_python; fi
}
