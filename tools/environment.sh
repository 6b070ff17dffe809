# Sourced by the other tools: $root, the repository, and `environment`, which makes .venv ready in it.
# Nothing is installed again until pyproject.toml or constraints.txt changes.

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
bin="$root/.venv/bin"

say() { echo "$*" >&2; }

find_python() { # the first Python that is new enough
    local candidate
    for candidate in "${PYTHON:-python3}" python3.11 python3.12 python3.13 python3.14; do
        if "$candidate" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
            echo "$candidate"
            return
        fi
    done
    say "error: Python 3.11 or newer is needed, found ${PYTHON:-python3} = $("${PYTHON:-python3}" --version 2>&1)"
    say "       install one, or name one: PYTHON=/path/to/python $0"
    return 1
}

as_root() { # run as root, without asking for a password; fails where that is not possible
    if [ "$(id -u)" = 0 ]; then "$@"; else sudo -n "$@" 2>/dev/null; fi
}

debian_install() { # install Debian packages; fails where that is not allowed
    command -v apt-get >/dev/null && as_root true || return 1
    as_root env DEBIAN_FRONTEND=noninteractive apt-get update -qq >&2 &&
        as_root env DEBIAN_FRONTEND=noninteractive \
            apt-get install -qq -y --no-install-recommends "$@" >&2
}

make_venv() {
    local python
    python="$(find_python)"
    say "making $root/.venv with $("$python" --version)"
    "$python" -m venv "$root/.venv" && return
    debian_install python3-venv && "$python" -m venv "$root/.venv" && return
    rm -rf "$root/.venv"
    say "error: $python cannot make a virtual environment; on Debian: apt-get install python3-venv"
    return 1
}

environment() { # .venv with this package, editable, and the pinned versions of all it needs
    local stamp
    [ -x "$bin/python" ] || make_venv
    stamp="$(cat "$root/pyproject.toml" "$root/constraints.txt" | sha256sum) $root"
    if [ "$(cat "$root/.venv/installed" 2>/dev/null)" != "$stamp" ]; then
        say "installing the package and what it needs (a minute the first time) ..."
        "$bin/python" -m pip install -q --disable-pip-version-check \
            -c "$root/constraints.txt" -e "$root[test]"
        echo "$stamp" >"$root/.venv/installed"
    fi
}

peers_present() {
    local program
    for program in mbpoll tshark gcc pkg-config chromium systemd-analyze openssl; do
        command -v "$program" >/dev/null || return 1
    done
    pkg-config --exists libmodbus
}

peers() { # the foreign programs of the peer tests; without them those tests skip, or fail in CI
    peers_present && return
    [ -e "$root/.venv/peers_refused" ] && [ -z "${ROADLOAD_REQUIRE_PEERS:-}" ] && return
    say "installing mbpoll, tshark, libmodbus, a C compiler, Chromium, systemd and openssl ..."
    debian_install mbpoll tshark libmodbus-dev gcc libc6-dev pkg-config &&
        debian_install chromium systemd openssl && return
    touch "$root/.venv/peers_refused"
    say "could not install all of them (no root, or no apt-get): peer tests that miss theirs skip"
}
