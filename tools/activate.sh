# Sourced with ROOT set: loads the environment (as .rig/env.sh describes it) and the built packages into this shell.
# Says what `source install/setup.bash` says, but without the half second that it takes.

. "$ROOT/.rig/env.sh"
shopt -s nullglob
for prefix in ${GSENSE_UNDERLAY_ONLY:+/nowhere/} "$ROOT"/install/*/; do
    [[ -z ${GSENSE_UNDERLAY_ONLY:-} ]] || break
    prefix=${prefix%/}
    export AMENT_PREFIX_PATH=$prefix${AMENT_PREFIX_PATH:+:$AMENT_PREFIX_PATH}
    export CMAKE_PREFIX_PATH=$prefix${CMAKE_PREFIX_PATH:+:$CMAKE_PREFIX_PATH}
    for folder in "$prefix"/lib/python3*/site-packages; do
        export PYTHONPATH=$folder${PYTHONPATH:+:$PYTHONPATH}
    done
    for library in "$prefix"/lib/*.so; do
        export LD_LIBRARY_PATH=$prefix/lib${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}
        break
    done
done
shopt -u nullglob
unset prefix folder library

# All traffic stays on this machine unless the user said otherwise.
export ROS_AUTOMATIC_DISCOVERY_RANGE=${ROS_AUTOMATIC_DISCOVERY_RANGE:-LOCALHOST}
export RMW_IMPLEMENTATION=${RMW_IMPLEMENTATION:-rmw_fastrtps_cpp}
# Python's byte code is kept (without it a node takes 3 s longer to start), and not among the sources.
unset PYTHONDONTWRITEBYTECODE
export PYTHONPYCACHEPREFIX=${PYTHONPYCACHEPREFIX:-$ROOT/.rig/cache/python}
# The home folder may be empty or read-only: what is cached or logged lies in the checkout.
export NUMBA_CACHE_DIR=${NUMBA_CACHE_DIR:-$ROOT/.rig/cache/numba}
export MPLCONFIGDIR=${MPLCONFIGDIR:-$ROOT/.rig/cache/matplotlib}
export ROS_LOG_DIR=${ROS_LOG_DIR:-$ROOT/.rig/log/ros}
export COLCON_HOME=${COLCON_HOME:-$ROOT/.rig/colcon}
export COLCON_DEFAULTS_FILE=${COLCON_DEFAULTS_FILE:-$ROOT/tools/colcon.yaml}
export MPLBACKEND=${MPLBACKEND:-Agg}
