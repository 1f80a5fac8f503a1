# Progress of what takes long, as its log tells it: sourced, never run.
# shellcheck shell=bash

readonly PROGRESS_EVERY_S=10
progress_pid=""

# start_progress LABEL LOG [AFTER_S]: until stop_progress, say on standard error how far it is, what it does and how long
# it has taken. On a terminal that is one line, written anew every second; elsewhere a line now and then.
start_progress() {
  tell_progress "$@" </dev/null >/dev/null &
  progress_pid=$!
}

stop_progress() {
  [[ -n $progress_pid ]] || return 0
  { kill "$progress_pid" && wait "$progress_pid"; } 2>/dev/null || true
  progress_pid=""
  clear_line
}

# say_in_line TEXT: on a terminal in its last line, as much as fits, to be replaced by the next; elsewhere as a line.
say_in_line() {
  if [[ ! -t 2 ]]; then
    echo "$1" >&2
    return
  fi
  local columns
  columns=$(stty size <&2 2>/dev/null | cut -d' ' -f2)
  ((columns > 1)) || columns=80
  printf '\r\e[K%.*s' "$((columns - 1))" "$1" >&2
}

# What stands in the terminal's last line is not needed any more.
clear_line() { if [[ -t 2 ]]; then printf '\r\e[K' >&2; fi; }

# Ends with the script that started it, even when that is killed.
tell_progress() {
  local label=$1 log=$2 due=${3:-1} every=1 start=$SECONDS elapsed
  if [[ ! -t 2 ]]; then every=$PROGRESS_EVERY_S due=$((due > every ? due : every)); fi
  while sleep 1 2>/dev/null && kill -0 "$$" 2>/dev/null; do
    elapsed=$((SECONDS - start))
    ((elapsed >= due)) || continue
    due=$((due + every))
    say_in_line "$label ... $elapsed s  $(doing "$log")"
  done
}

# What a log says last, since its last heading: ninja's "[12/345] task.cpp", else the line as it is.
doing() {
  awk '
    /^### / { said = built = ""; next }
    /^\[[0-9]+\/[0-9]+\] / { count = $1; sub(/\.o$/, ""); sub(/.*[ \/]/, ""); built = count " " $0; next }
    /[^ ]/ { said = $0 }
    END { print built != "" ? built : said }
  ' "$1" 2>/dev/null || true
}
