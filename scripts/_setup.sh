# Sourced by the other scripts: a ready .venv and, on Debian and Ubuntu, the OpenGL driver.
#
#   set_up base     what `glshadow render` needs
#   set_up dev      that, the test tools and the programs that tests use
#
# A stamp in .venv (hash of pyproject.toml and of the checkout's path) lets the second call return immediately.

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd -P)
venv=$root/.venv
python=$venv/bin/python

say() { printf 'glshadow: %s\n' "$*" >&2; }

fail() {
    say "$*"
    exit 1
}

set_up() { # base | dev
    local key
    key=$({ cat "$root/pyproject.toml" && printf '%s' "$root"; } | sha256sum)
    is_stamped "$1" "$key" && return
    # Concurrent calls must not install into the same .venv; the second waits here and then finds the stamp.
    exec 9<"$root/pyproject.toml"
    flock 9
    if ! is_stamped "$1" "$key"; then
        find_python
        install_driver
        if [[ $1 == dev ]]; then install_test_programs; fi
        make_venv
        install_package "$1"
        install_libraries
        printf '%s' "$key" >"$venv/.set-up-$1"
        say "set-up done"
    fi
    exec 9<&-
}

is_stamped() { # base|dev key
    [[ -x $python && -f $venv/.set-up-$1 && $(<"$venv/.set-up-$1") == "$2" ]]
}

find_python() { # sets base_python
    local name
    for name in python3 python3.14 python3.13 python3.12 python3.11; do
        if command -v "$name" >/dev/null && "$name" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
            base_python=$(command -v "$name")
            return
        fi
    done
    fail "Python 3.11 or newer is needed and was not found as python3 (Debian 12, Ubuntu 23.04 or later: apt-get install python3 python3-venv)"
}

make_venv() {
    # pip's own check also detects a .venv that was moved or is incomplete.
    if [[ -x $python ]] && "$python" -m pip --version >/dev/null 2>&1; then return; fi
    if ! "$base_python" -c 'import ensurepip, venv' 2>/dev/null; then
        apt_install "Python's venv module is missing" python3-venv
    fi
    say "making the virtual environment .venv with $("$base_python" --version)"
    "$base_python" -m venv --clear "$venv"
}

install_package() { # base | dev
    local target=$root
    if [[ $1 == dev ]]; then target="$root[dev]"; fi
    say "installing glshadow and what it needs into .venv (a minute or two the first time)"
    "$python" -m pip install --quiet --disable-pip-version-check --no-input --editable "$target" >&2 ||
        fail "pip could not install the packages of pyproject.toml; its message is above"
}

install_libraries() { # libraries that the installed wheels need but do not contain
    [[ $(uname -s) == Linux ]] || return 0
    local packages
    mapfile -t packages < <("$python" "$root/scripts/libraries.py")
    if [[ ${#packages[@]} -eq 0 ]]; then return 0; fi
    apt_install "what is in .venv needs ${packages[*]}" "${packages[@]}"
}

has_library() { # soname ...: any of them can be loaded
    "$base_python" - "$@" <<'PY'
import ctypes, sys
def loads(name):
    try:
        return bool(ctypes.CDLL(name))
    except OSError:
        return False
sys.exit(not any(loads(name) for name in sys.argv[1:]))
PY
}

has_driver() {
    local pattern vendor
    for pattern in '/usr/lib*/*/dri/swrast_dri.so' '/usr/lib*/dri/swrast_dri.so' '/usr/lib*/*/libgallium*.so' '/usr/lib*/libgallium*.so'; do
        if compgen -G "$pattern" >/dev/null; then return 0; fi
    done
    # A GPU vendor's driver registers with glvnd here, next to Mesa's entry.
    for vendor in {/etc,/usr/share}/glvnd/egl_vendor.d/*.json; do
        if [[ -e $vendor && $vendor != *mesa* ]]; then return 0; fi
    done
    return 1
}

install_driver() {
    [[ $(uname -s) == Linux ]] || return 0
    if has_library libEGL.so.1 && has_driver; then return 0; fi
    apt_install "libEGL.so.1 or an OpenGL driver is missing" libegl1 libgl1-mesa-dri
}

install_test_programs() {
    local missing=()
    [[ $(uname -s) == Linux ]] || return 0
    has_library libOSMesa.so.8 libOSMesa.so.6 libOSMesa.so || missing+=(libosmesa6)
    command -v Xvfb >/dev/null || missing+=(xvfb)
    command -v xdotool >/dev/null || missing+=(xdotool)
    command -v chromium >/dev/null || command -v google-chrome >/dev/null || missing+=(chromium)
    command -v glslangValidator >/dev/null || missing+=(glslang-tools)
    if [[ ${#missing[@]} -eq 0 ]]; then return 0; fi
    if [[ ${CI:-} == true ]]; then
        apt_install "the tests need ${missing[*]} in CI" "${missing[@]}"
    else
        # Newer Mesa has no OSMesa: packages are installed one by one, and tests that need a missing one are skipped by name.
        local package
        for package in "${missing[@]}"; do
            (apt_install "some tests will be skipped without $package" "$package") || true
        done
    fi
}

apt_install() { # reason package ...
    local reason=$1
    shift
    if ! command -v apt-get >/dev/null; then fail "$reason; install the equivalent of the Debian packages: $*"; fi
    if [[ $(id -u) -ne 0 ]]; then fail "$reason; as root run: apt-get install $*"; fi
    say "$reason; installing $*"
    export DEBIAN_FRONTEND=noninteractive
    apt-get install --yes --quiet --no-install-recommends "$@" </dev/null >/dev/null 2>&1 && return
    # A fresh system image has no package lists.
    apt-get update --quiet </dev/null >/dev/null 2>&1 || true
    apt-get install --yes --quiet --no-install-recommends "$@" </dev/null >&2 || fail "$reason, and apt-get could not install: $*"
}
