# The Python packages in .venv, ROS 2's wheels among them: sourced by scripts/setup, never run.
# shellcheck shell=bash disable=SC2154 # with_...: what scripts/setup was asked for

readonly MIN_PYTHON="3.11"

# The interpreter .venv is made from: never one of this clone's own .venv.
base_python() {
  if [[ -n ${MAUVE_PYTHON:-} ]]; then
    echo "$MAUVE_PYTHON"
  elif [[ -n $jazzy ]]; then
    local folder
    for folder in "$jazzy"/lib/python3.*; do
      command -v "/usr/bin/${folder##*/}" && return 0
    done
    command -v python3
  else
    PATH=":$PATH:" bash -c 'p=${PATH//":$1:"/:}; PATH=${p#:}; command -v python3' _ "$MAUVE_VENV/bin"
  fi
}

# Recent enough, with venv, pip and the headers that extension modules need.
python_can_build() {
  "$1" - "$MIN_PYTHON" 2>/dev/null <<'PYTHON'
import ensurepip, os, sys, sysconfig, venv
ok = sys.version_info >= tuple(map(int, sys.argv[1].split(".")))
sys.exit(not (ok and os.path.exists(os.path.join(sysconfig.get_paths()["include"], "Python.h"))))
PYTHON
}

# requirement_files SET: what must be there for `base` (to build and to run), `tests`, `lint` or `docs`.
requirement_files() {
  local names=(run build) name
  [[ -n $jazzy ]] || names+=(ros-wheels ros-wheels-build)
  case $1 in
    tests) names+=(test) ;;
    lint) names+=(test lint) ;;
    docs) names=(docs) ;; # of MAUVE RT, pages need the stubs only
  esac
  for name in "${names[@]}"; do echo "$MAUVE_ROOT/requirements/$name.txt"; done
}

# What a set in .venv depends on; when it changes, pip is asked again.
python_key() {
  {
    echo "jazzy=$jazzy root=$MAUVE_ROOT"
    "$MAUVE_VENV/bin/python" -I -S -c 'import sys; print(sys.version, sys.base_prefix)' 2>/dev/null || echo none
    requirement_files "$1" | tr '\n' '\0' | xargs -0 cat
    cat "$MAUVE_ROOT"/requirements/{constraints,installer}.txt "$MAUVE_ROOT/scripts/patch_wheels.py"
  } | sha256sum | cut -d' ' -f1
}

python_stamp() { echo "$MAUVE_VENV/.mauve-stamp-$1"; }

has_python_packages() {
  local stamp
  stamp=$(python_stamp "$1")
  [[ -f $stamp && $(<"$stamp") == "$(python_key "$1")" ]]
}

# The sets that this run needs in .venv, one a line.
python_sets() {
  if $only_docs; then
    echo docs
    return
  fi
  echo base
  if $with_tests || $with_benchmarks; then echo tests; fi # benchmarks read bags as others do
  if $with_lint; then printf '%s\n' lint docs; fi # scripts/lint builds the documentation
}

ensure_python_packages() {
  local sets set
  mapfile -t sets < <(python_sets)
  for set in "${sets[@]}"; do ensure_python_set "$set"; done
}

ensure_python_set() {
  local stamp what=${1/base/to build and run}
  stamp=$(python_stamp "$1")
  if has_python_packages "$1"; then return 0; fi
  venv_usable || make_venv
  rm -f "$stamp"
  step "python packages (${what})" install_python_packages "$1"
  [[ -n $jazzy ]] || step "wheel paths" clean_python "$MAUVE_ROOT/scripts/patch_wheels.py"
  [[ -z $jazzy ]] || echo "$jazzy" >"$MAUVE_VENV/.mauve-jazzy"
  python_key "$1" >"$stamp"
}

make_venv() {
  if [[ -L $MAUVE_VENV ]]; then # making it anew would empty what the link leads to
    echo "setup: .venv is a link to $(readlink "$MAUVE_VENV"), an environment made for another place; remove the link" >&2
    exit 2
  fi
  local python options=()
  python=$(base_python)
  python_can_build "$python" || {
    echo "setup: $python is no Python >= $MIN_PYTHON with venv and headers; name another by MAUVE_PYTHON" >&2
    exit 2
  }
  [[ -z $jazzy ]] || options+=(--system-site-packages)
  step "python environment (.venv)" "$python" -m venv --clear "${options[@]}" "$MAUVE_VENV"
}

# It runs, it was made in this place, and for the same kind of ROS.
venv_usable() {
  local want=false
  [[ -z $jazzy ]] || want=true
  "$MAUVE_VENV/bin/python" -I -S -c '' 2>/dev/null &&
    grep -q "include-system-site-packages = $want" "$MAUVE_VENV/pyvenv.cfg" &&
    grep -qF "VIRTUAL_ENV=" "$MAUVE_VENV/bin/activate" && grep -qF "$MAUVE_VENV" "$MAUVE_VENV/bin/activate"
}

# By uv where it can, with all downloads at once, else by pip, which also knows a user's own index and certificates.
# Compiled here, as pip does it: who may not write here, or is told not to, would compile at every start.
# uv links the files of its cache rather than copy them, where both are on one disk: they take their space once.
install_python_packages() { # SET
  local files=() file
  while read -r file; do files+=(-r "$file"); done < <(requirement_files "$1")
  local pip=(clean_python -m pip install --disable-pip-version-check --no-input --no-cache-dir)
  if ! { "${pip[@]}" -r "$MAUVE_ROOT/requirements/installer.txt" &&
    clean_python -m uv pip install --system-certs --compile-bytecode --python "$MAUVE_VENV" "${files[@]}"; }; then
    "${pip[@]}" "${files[@]}"
  fi
}

# The environment's python without what another environment may have exported.
clean_python() { env -u PYTHONPATH -u PYTHONHOME _ROS_WHEELS_BOOTSTRAP_COMPLETE=1 "$MAUVE_VENV/bin/python" "$@"; }

