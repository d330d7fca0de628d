#!/bin/sh
# Makes a Python environment and prints its interpreter.
#
#     PYTHON=$(./scripts/python-env.sh)            # the outside readers that the record is checked with
#     PYTHON=$(./scripts/python-env.sh outside)    # the outside tools that the arm is checked and timed against
#
# It lies in the build folder; it is made once and again when its list changes.
set -eu
cd "$(dirname "$0")/.."
case ${1:-readers} in
readers)
    wanted='mcap==1.6.0 mcap-ros2-support==0.6.0 rosbags==0.11.9'
    folder=${CARGO_TARGET_DIR:-target}/python-env
    ;;
outside)
    wanted=$(tr '\n' ' ' <scripts/reference/requirements.txt)
    folder=${CARGO_TARGET_DIR:-target}/python-env-outside
    ;;
*)
    echo "python-env.sh: there is no environment '$1', expected readers or outside" >&2
    exit 2
    ;;
esac
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
