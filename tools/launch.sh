# Sourced by ./rig: starting what is installed.

# run_installed PKG EXE [ARGS]: what `ros2 run` does; replaces this process, so that signals reach the node
run_installed() {
    local package=$1 name=$2 prefix folder
    shift 2
    while IFS= read -r -d : prefix; do
        folder=$prefix/lib/$package
        [[ -f $folder/$name && -x $folder/$name ]] && exec "$folder/$name" "$@"
        [[ -e $prefix/share/$package/package.xml ]] && fail "package '$package' has no executable '$name'; it has: $(executables "$folder")"
    done <<<"$AMENT_PREFIX_PATH:"
    fail "no package '$package'; there is: $(cd "$ROOT/install" 2>/dev/null && printf '%s ' */ | tr -d /)"
}

# executables FOLDER: their names on one line
executables() {
    local file names=()
    for file in "$1"/*; do
        if [[ -f $file && -x $file ]]; then names+=("${file##*/}"); fi
    done
    echo "${names[*]:-none}"
}

# run_scripts WHAT SCRIPT... -- ARGS: run each Python script that exists; a line where there is none
run_scripts() {
    local what=$1 script scripts=()
    shift
    while [[ $1 != -- ]]; do
        if [[ -f $1 && ${1##*/} != _* ]]; then scripts+=("$1"); fi
        shift
    done
    shift
    if [[ ${#scripts[@]} == 0 ]]; then
        echo "gsense: this version has no $what yet"
        return
    fi
    prepare --dev --build stale
    for script in "${scripts[@]}"; do
        echo "== ${script#"$ROOT"/}"
        (cd "$ROOT" && python "$script" "$@")
    done
}

# list_benches: their names and the first line that each says of itself
list_benches() {
    local script line
    echo "usage: ./rig bench [NAME [ARGS]]    without NAME all but those of slow/; NAME --help has its ARGS"
    for script in "$ROOT"/tests/bench/{,slow/}*.py; do
        line=$(head -n 1 "$script") line=${line#\"\"\"}
        printf '  %-18s %s\n' "$(basename "$script" .py)" "${line%\"\"\"}"
    done
}

# run_bench [NAME [ARGS]]: one benchmark by name, or all that take about a minute (slow/ has the others)
run_bench() {
    local name=${1:-} script known=()
    if [[ $name == -h || $name == --help ]]; then
        list_benches
        return
    fi
    if [[ -z $name ]]; then
        run_scripts benchmark "$ROOT"/tests/bench/*.py --
        return
    fi
    shift
    for script in "$ROOT"/tests/bench/{,slow/}*.py; do
        known+=("$(basename "$script" .py)")
        if [[ ${known[-1]} == "$name" ]]; then
            run_scripts benchmark "$script" -- "$@"
            return
        fi
    done
    fail "no benchmark '$name'; there is: ${known[*]}"
}
