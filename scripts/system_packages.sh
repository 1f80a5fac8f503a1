# The system's packages that building needs, and how they are installed: sourced by scripts/setup, never run.
# shellcheck shell=bash disable=SC2154 # with_...: what scripts/setup was asked for

readonly APT_PATIENCE_S=600

# Looked for by the file each brings, not by dpkg: what was installed otherwise counts, and no package manager is asked.
# `make` is what CMake and colcon build with unless told otherwise, as who builds a package of their own will not.
missing_system_packages() {
  command -v g++ >/dev/null || echo g++
  command -v make >/dev/null || echo make
  command -v cmake >/dev/null || echo cmake
  command -v ninja >/dev/null || echo ninja-build
  command -v python3 >/dev/null || echo python3
  command -v dot >/dev/null || echo graphviz
  [[ -e /usr/include/yaml-cpp/yaml.h ]] || echo libyaml-cpp-dev
  [[ -e /usr/include/png.h ]] || echo libpng-dev
  [[ -e /usr/include/openssl/ssl.h ]] || echo libssl-dev
  [[ -e /usr/include/gtest/gtest.h ]] || echo libgtest-dev
  [[ -e /usr/include/gmock/gmock.h ]] || echo libgmock-dev
  [[ -e /usr/include/benchmark/benchmark.h ]] || echo libbenchmark-dev
  if ! python_can_build "$(base_python)"; then
    echo python3-venv
    echo python3-dev
  fi
  if $with_tests && ! command -v ccache >/dev/null; then echo ccache; fi # tests build most of it several times
  # Boost has the ring buffer that ours is compared with. Who may not install it has the other rows.
  if $with_benchmarks && [[ ! -e /usr/include/boost/lockfree/spsc_queue.hpp ]] && { ((!EUID)) || sudo -n true 2>/dev/null; }; then
    echo libboost-dev
  fi
  if $with_lint && ! command -v shellcheck >/dev/null; then echo shellcheck; fi
}

ensure_system_packages() {
  local missing
  mapfile -t missing < <(missing_system_packages)
  ((${#missing[@]})) || return 0
  command -v apt-get >/dev/null || cannot_install "there is no apt-get here" "${missing[@]}"
  echo "setup: system packages that are missing: ${missing[*]}" >&2
  get_root "${missing[@]}"
  step "system packages" apt_install "${missing[@]}"
}

# Set `as_root` to what runs a command as root. Where sudo wants a password, it asks for it on the terminal.
get_root() {
  as_root=()
  (($(id -u))) || return 0
  as_root=(sudo)
  command -v sudo >/dev/null || cannot_install "you are not root, and there is no sudo" "$@"
  sudo -n true 2>/dev/null && return 0
  [[ -t 0 ]] || cannot_install "sudo wants a password, and there is no terminal to ask for it" "$@"
  echo "setup: sudo asks for your password, to install them" >&2
  sudo -v || cannot_install "sudo did not let you" "$@"
}

apt_install() {
  apt_get update
  apt_get install -y --no-install-recommends -o APT::Keep-Downloaded-Packages=false "$@"
}

# apt-get itself waits for dpkg's lock only, not for the one of its lists or of its downloads.
apt_get() {
  local said="$MAUVE_BUILD/.apt-get.log" deadline=$((SECONDS + APT_PATIENCE_S)) status
  while true; do
    status=0
    "${as_root[@]}" env LC_ALL=C DEBIAN_FRONTEND=noninteractive apt-get -o "DPkg::Lock::Timeout=$APT_PATIENCE_S" "$@" 2>&1 |
      tee "$said" || status=$?
    if ((!status || SECONDS >= deadline)) || ! grep -qE 'Could not get lock|Unable to lock' "$said"; then return "$status"; fi
    echo "waiting for another package manager, which holds apt's lock"
    sleep 2
  done
}

cannot_install() { # WHY PACKAGE...
  local sudo="sudo "
  command -v sudo >/dev/null || sudo=""
  {
    echo "setup: system packages are missing, and $1; install them$([[ -n $sudo ]] || echo " as root") with"
    echo "  ${sudo}apt-get update && ${sudo}apt-get install -y --no-install-recommends ${*:2}"
  } >&2
  exit 2
}
