# Replaces commands of the pages that take minutes or change the machine: checks only that what they name exists.

make() { command make --dry-run --silent --directory "$ROOT" "$@" > /dev/null; }

pip() { # pip install ".[EXTRA,..]" PACKAGE ..
  local extras extra
  extras=$(grep -o '\[[a-z0-9,]*\]' <<< "$*" | tr -d '[]' | tr ',' ' ') || true
  for extra in $extras; do grep -q "^$extra = \[" "$ROOT/pyproject.toml" || { echo "no extra $extra" >&2; return 1; }; done
}

source() { :; }

python() {
  case "$1 ${2:-}" in
    "-m training" | "-m studies" | "-m speed") command python -m "$2" "$3" --help > /dev/null ;;
    "-m "*) ;; # of another library
    *) test -f "$1" ;;
  esac
}

tensorboard() { :; }
