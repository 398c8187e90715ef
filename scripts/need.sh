# Sourced by check.sh and test.sh.

# need PACKAGE...: installs the Debian packages that are missing. Does nothing where there is no dpkg: there the tools
# themselves have to be present already.
need() {
    command -v dpkg-query >/dev/null 2>&1 || return 0
    missing=""
    for package in "$@"; do
        if [ "$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null)" != installed ]; then
            missing="$missing $package"
        fi
    done
    [ -n "$missing" ] || return 0
    as_root=""
    if [ "$(id -u)" -ne 0 ]; then
        if ! command -v sudo >/dev/null 2>&1; then
            echo "these packages are missing, and installing them takes root:$missing" >&2
            exit 2
        fi
        as_root="sudo"
    fi
    echo "installing:$missing" >&2
    export DEBIAN_FRONTEND=noninteractive
    $as_root apt-get -qq update >&2
    # shellcheck disable=SC2086 # the list is words
    $as_root apt-get -qq install -y --no-install-recommends $missing >&2
}

# need_cargo: the Rust toolchain is the one thing that is not installed for you.
need_cargo() {
    command -v cargo >/dev/null 2>&1 || PATH="$HOME/.cargo/bin:$PATH"
    if ! command -v cargo >/dev/null 2>&1; then
        echo "cargo is missing: install the Rust toolchain first (https://rustup.rs)" >&2
        exit 2
    fi
}
