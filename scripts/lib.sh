# Shared by the scripts of this folder: sourced, never run.
# shellcheck shell=bash disable=SC2034 # variables for the scripts that source it

MAUVE_ROOT="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)"
MAUVE_VENV="$MAUVE_ROOT/.venv"
MAUVE_BUILD="$MAUVE_ROOT/build"
MAUVE_INSTALL="$MAUVE_ROOT/install"

# Print the comment at the top of the running script.
usage() {
  local line
  while IFS= read -r line && [[ $line == '#'* ]]; do
    [[ $line == '#!'* ]] && continue
    line=${line#'#'}
    echo "${line# }"
  done <"$0"
}

# Where --help is among the arguments, it is answered: before anything is built, and by the shell alone.
help_if_asked() {
  local argument
  for argument; do
    case $argument in
      --help | -h) usage; exit 0 ;;
      --) return 0 ;;
    esac
  done
}

# refuse_unknown_options ARGUMENT...: end the script with status 2 for an option that the comment at its top does not list.
# Before anything is built, and by the shell alone. The program behind the script checks values.
refuse_unknown_options() {
  local name=${0##*/} known=" " line argument
  while IFS= read -r line; do
    if [[ $line =~ ^\ +(--[a-z-]+) ]]; then known+="${BASH_REMATCH[1]} "; fi
  done < <(usage)
  for argument; do
    if [[ $argument == --?* && $known != *" ${argument%%=*} "* ]]; then
      echo "$name: unknown option $argument. scripts/$name --help lists the options." >&2
      exit 2
    fi
  done
}

# mauve_ready [SETUP OPTION...]: build what is not built yet (silent when all is up to date) and load the environment.
# Ends the script on failure.
mauve_ready() {
  "$MAUVE_ROOT/scripts/setup" --quiet "$@" || exit $?
  mauve_environment
}

# Load install/setup.bash into this shell.
mauve_environment() {
  # shellcheck source=/dev/null
  source "$MAUVE_INSTALL/setup.bash"
}

# Seconds since the epoch with milliseconds, as an integer of milliseconds.
now_ms() {
  local now=${EPOCHREALTIME/[.,]/}
  echo $((now / 1000))
}

# 12345 -> 12.3
seconds_of_ms() { printf '%d.%d' $(($1 / 1000)) $(($1 % 1000 / 100)); }

# Set `cpu_ms` to the CPU time of all commands that this shell has waited for.
count_cpu_ms() {
  local log="$MAUVE_BUILD/.times.$BASHPID"
  times >"$log" # not in a subshell: that one has waited for none
  cpu_ms=$(awk -F '[ms. ,]+' 'NR == 2 { print 60000 * ($1 + $4) + 1000 * ($2 + $5) + $3 + $6 }' "$log")
  rm "$log"
}

# with_lock NAME COMMAND...: one at a time in this clone; a second caller waits and says so.
with_lock() {
  local lock="$MAUVE_BUILD/.$1.lock" status
  shift
  mkdir -p "$MAUVE_BUILD"
  exec {lock_fd}>"$lock"
  if ! flock -n "$lock_fd"; then
    echo "waiting for another run in this clone" >&2
    flock "$lock_fd"
  fi
  "$@"
  status=$?
  exec {lock_fd}>&-
  return "$status"
}

# run_stage NAME COMMAND...: print the stage's name, its outcome and its duration; remember a failure in failed_stages.
failed_stages=()
run_stage() {
  local name=$1 start outcome=ok
  shift
  start=$(now_ms)
  printf '\n== %s\n' "$name"
  if ! "$@"; then
    outcome=FAILED
    failed_stages+=("$name")
  fi
  printf '== %s: %s (%s s)\n' "$name" "$outcome" "$(seconds_of_ms $(($(now_ms) - start)))"
}
