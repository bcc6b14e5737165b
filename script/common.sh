# SPDX-License-Identifier: MIT
# shellcheck shell=sh
# What the scripts share: the Debian packages, and how to get those that are missing. Sourced, never run.

# To build and run the library and the program. mesa-vulkan-drivers brings the software driver along.
FATHOM_BUILD_PACKAGES="gcc libc6-dev cmake ninja-build pkg-config zlib1g-dev libpng-dev libnifti-dev libteem-dev libargtable2-dev
libcjson-dev libvulkan-dev glslc mesa-vulkan-drivers"

# To build and run the painting program too.
FATHOM_APP_PACKAGES="g++ libglfw3-dev libimgui-dev fonts-dejavu-core"

# To run the tests, sanitizers and fuzzers too: these, and those of the painting program.
FATHOM_TEST_PACKAGES="vulkan-validationlayers clang libclang-rt-dev python3-minimal xvfb xdotool openbox imagemagick
libnanovdb-tools python3-openvdb python3-numpy"

fail() {
    echo "$(basename "$0"): $*" >&2
    exit 1
}

# need_packages NAME...: installs those that are missing; asks for root only if there are some.
need_packages() {
    missing=""
    for package in "$@"; do
        case "$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null)" in
        installed) ;;
        *) missing="$missing $package" ;;
        esac
    done
    [ -n "$missing" ] || return 0
    command -v apt-get >/dev/null || fail "these Debian packages or their likes are needed:$missing"
    root=""
    if [ "$(id -u)" != 0 ]; then
        command -v sudo >/dev/null || fail "run as root once, or install sudo, to get the missing packages:$missing"
        root=sudo
        echo "Asking for root to install:$missing"
    fi
    # shellcheck disable=SC2086
    $root apt-get update -qq || fail "apt-get update failed: check the network and /etc/apt/sources.list"
    # shellcheck disable=SC2086
    $root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $missing >/dev/null ||
        fail "apt-get could not install:$missing"
}
