#!/bin/sh
# Makes a Python environment with the outside readers that the record is checked with, and prints its interpreter.
#
#     PYTHON=$(./scripts/python-env.sh)
#
# It lies in the build folder; it is made once and again when the list below changes.
set -eu
cd "$(dirname "$0")/.."
wanted='mcap==1.6.0 mcap-ros2-support==0.6.0 rosbags==0.11.9'
folder=${CARGO_TARGET_DIR:-target}/python-env
if [ "$(cat "$folder/made-of" 2>/dev/null)" != "$wanted" ]; then
    rm -rf "$folder"
    python3 -m venv "$folder" >&2 || {
        echo "python-env.sh: no Python virtual environments here (Debian, Ubuntu: apt-get install python3-venv)" >&2
        exit 1
    }
    # shellcheck disable=SC2086 # a list
    "$folder/bin/pip" install --quiet --disable-pip-version-check $wanted >&2
    printf '%s' "$wanted" >"$folder/made-of"
fi
echo "$folder/bin/python"
