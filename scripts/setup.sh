# Sourced by the other scripts: what the rack needs beyond a Rust toolchain is a C compiler (lz4 of the record).
if ! command -v cargo >/dev/null; then
    # a toolchain that this shell has not been told of
    [ -r "$HOME/.cargo/env" ] && source "$HOME/.cargo/env"
fi
if ! command -v cargo >/dev/null; then
    echo "No Rust toolchain found. Install one (rustup, 1.90 or newer) and start again." >&2
    exit 1
fi

# Installs Debian packages, as root or with sudo; says what is missing where neither is there.
need_packages() {
    local as_root=()
    if [ "$(id -u)" -ne 0 ]; then
        if ! command -v sudo >/dev/null; then
            echo "Please install: $*" >&2
            exit 1
        fi
        as_root=(sudo)
    fi
    "${as_root[@]}" apt-get update -qq
    "${as_root[@]}" apt-get install -y -qq "$@"
}

command -v cc >/dev/null || need_packages build-essential
