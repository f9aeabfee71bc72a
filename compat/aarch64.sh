#!/usr/bin/env bash
# Plays the golden episodes with the ARM wheel of dist/ in an emulator. Usage: compat/aarch64.sh FOLDER UV TESTS...
# Requires Debian 12 (Python 3.11). apt downloads an ARM Python, and qemu unless it is there, into FOLDER.
set -euo pipefail
folder=$(realpath --canonicalize-missing "$1") uv=$2
shift 2

unpack() { # architecture, packages: download them with their dependencies and unpack them into $folder/$architecture
  local state="$folder/apt-$1" architecture=$1
  shift
  mkdir -p "$state"/{lists,archives}/partial "$folder/$architecture"
  : > "$state/status"
  local options=(-o "APT::Architecture=$architecture" -o "APT::Architectures=$architecture" -o "Dir::State=$state"
    -o "Dir::State::status=$state/status" -o "Dir::Cache=$state" -o APT::Sandbox::User= -o APT::Install-Recommends=false -qq)
  apt-get "${options[@]}" update
  apt-get "${options[@]}" install --yes --download-only "$@"
  for package in "$state"/archives/*.deb; do dpkg-deb --extract "$package" "$folder/$architecture"; done
}

[ -x "$folder/arm64/usr/bin/python3" ] || unpack arm64 python3 libstdc++6
qemu=$(command -v qemu-aarch64-static || true)
if [ -z "$qemu" ]; then
  qemu="$folder/$(dpkg --print-architecture)/usr/bin/qemu-aarch64-static"
  [ -x "$qemu" ] || unpack "$(dpkg --print-architecture)" qemu-user-static
fi
emulated=("$qemu" -L "$folder/arm64" -E "PYTHONPATH=$folder/packages" "$folder/arm64/usr/bin/python3")

rm -rf "$folder/packages"
"$uv" pip install --quiet --target "$folder/packages" --constraint constraints.txt --only-binary :all: \
  --python-platform aarch64-manylinux_2_28 --python-version 3.11 covertable hypothesis pytest dist/*aarch64.whl
"${emulated[@]}" -c 'import platform; print(platform.machine(), platform.python_version())'
"${emulated[@]}" -P -m pytest -p no:cacheprovider "$@"
