# Shared by scripts/run and scripts/test: packages, virtual environment, build, multicast route.
# Sourced, never run. Every step checks first, and acts only if something is missing, so that a second
# start needs neither network nor privileges.
# shellcheck shell=bash disable=SC2034  # the constants are for the scripts that source this

ruedo_root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
ruedo_venv=$ruedo_root/.venv
ruedo_build=$ruedo_root/build/release

readonly EXIT_BUILD=1 EXIT_ENVIRONMENT=4

# Packages: "a|b" is the first of them that this distribution has; "?a" is left out where it has none.
# What Ruedo is compiled with and linked to; scripts/sysroot takes these for another architecture.
readonly BUILD_LIBRARIES=(
  libbullet-dev libtinyxml2-dev liburdfdom-dev libyaml-cpp-dev libassimp-dev libembree-dev libtbb-dev libeigen3-dev
  "?libosmesa6-dev" libegl-dev libegl-mesa0 libgl-dev
  libopencv-core-dev libopencv-imgcodecs-dev libopencv-imgproc-dev
  libcli11-dev libspdlog-dev libfmt-dev libssl-dev zlib1g-dev libzstd-dev libseccomp-dev "libglib2.0-0t64|libglib2.0-0" libwebsockets-dev nlohmann-json3-dev cyclonedds-dev
  musl-dev
)
readonly BUILD_PACKAGES=(
  g++ cmake ninja-build pkg-config ccache python3-venv python3-dev default-jdk-headless ca-certificates iproute2
  "${BUILD_LIBRARIES[@]}"
)
# libsdformat is the oracle of the world reader's tests; Debian has it up to 12. clang builds the fuzzers; nftables
# is the firewall that a test runs into; libfaketime sets clocks; debootstrap makes bare systems to try the wheel in; MPFR is the oracle of the elementary functions, and qemu has other processors; ffmpeg makes videos; libabigail compares binary interfaces.
readonly TEST_PACKAGES=(
  libgtest-dev libgmock-dev libbenchmark-dev libopencv-contrib-dev "?libsdformat-dev" "?chromium" clang "?libclang-rt-dev"
  nftables libmpfr-dev qemu-user libfaketime maven doxygen debootstrap ffmpeg abigail-tools
)

# The web console's page is built by node and npm; a machine with an npm from elsewhere keeps that.
console_packages=()
command -v npm >/dev/null || console_packages=(nodejs npm)

say() { printf '%s: %s\n' "${0##*/}" "$*" >&2; }

fail() {    # CODE MESSAGE...
  local code=$1
  shift
  say "$*"
  exit "$code"
}

# Prints those of the given package specifications that have to be installed, as names for apt.
missing_packages() {
  local spec name wanted=() alternatives
  local -A installed=() known=()
  mapfile -t alternatives < <(printf '%s\n' "${@#\?}" | tr '|' '\n')
  while read -r name; do installed[$name]=1; done < <(
    dpkg-query -W -f='${db:Status-Status} ${Package}\n' "${alternatives[@]}" 2>/dev/null | sed -n 's/^installed //p')
  for spec in "$@"; do
    IFS='|' read -ra alternatives <<<"${spec#\?}"
    for name in "${alternatives[@]}"; do
      [[ -z ${installed[$name]:-} ]] || continue 2
    done
    wanted+=("$spec")
  done
  ((${#wanted[@]})) || return 0
  mapfile -t alternatives < <(printf '%s\n' "${wanted[@]#\?}" | tr '|' '\n')
  while read -r name; do known[$name]=1; done < <(
    apt-cache show --no-all-versions "${alternatives[@]}" 2>/dev/null | sed -n 's/^Package: //p')
  for spec in "${wanted[@]}"; do
    IFS='|' read -ra alternatives <<<"${spec#\?}"
    for name in "${alternatives[@]}"; do
      if [[ -n ${known[$name]:-} ]]; then
        printf '%s\n' "$name"
        continue 2
      fi
    done
    # Unknown to apt (or apt's lists are not there yet): the last alternative stands for all, an optional one for none.
    [[ $spec == \?* ]] || printf '%s\n' "${alternatives[-1]}"
  done
}

# Installs what is missing of the given packages: one call of apt, only when there is something to install.
ensure_packages() {
  if ! command -v apt-get >/dev/null; then
    say "no apt-get here: install what docs/install.md lists, by your system's means"
    return
  fi
  local missing
  mapfile -t missing < <(missing_packages "$@")
  ((${#missing[@]})) || return 0
  local as_root=()
  if ((EUID != 0)); then
    if command -v sudo >/dev/null && { sudo -n true 2>/dev/null || { [[ -t 0 ]] && sudo -v; }; }; then
      as_root=(sudo)
    else
      say "packages are missing, and there is neither root nor sudo. Ask for this line to be run:"
      printf '    apt-get install --no-install-recommends -y %s\n' "${missing[*]}"
      exit "$EXIT_ENVIRONMENT"
    fi
  fi
  say "updating the package lists"
  "${as_root[@]}" apt-get update -q >/dev/null || say "the package lists could not be updated; going on with the old ones"
  mapfile -t missing < <(missing_packages "$@")
  say "installing ${#missing[@]} packages: ${missing[*]}"
  local progress=/dev/null
  [[ ! -t 2 ]] || progress=/dev/stderr
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install --no-install-recommends -y -q "${missing[@]}" >"$progress" ||
    fail "$EXIT_ENVIRONMENT" "apt-get could not install the packages; the lines above say why"
}

# .venv with what requirements.txt asks for.
ensure_venv() {
  local requirements="$ruedo_root/scripts/requirements.txt" stamp="$ruedo_venv/ruedo-requirements.txt"
  if cmp -s "$requirements" "$stamp" && "$ruedo_venv/bin/python" -c 'import lcm, nanobind, numpy, pytest' 2>/dev/null; then
    return
  fi
  if ! "$ruedo_venv/bin/python" -m pip --version >/dev/null 2>&1; then
    say "making the virtual environment .venv"
    python3 -m venv --clear "$ruedo_venv" || fail "$EXIT_ENVIRONMENT" "python3 -m venv failed (package python3-venv)"
  fi
  say "installing LCM and what the Python client needs into .venv"
  "$ruedo_venv/bin/python" -m pip install --quiet --disable-pip-version-check -r "$requirements" ||
    fail "$EXIT_ENVIRONMENT" "pip could not install scripts/requirements.txt; the lines above say why"
  cp "$requirements" "$stamp"
}

# Compilers side by side: one for each core, and no more than one for each 1.5 GB of memory.
build_jobs() {
  local cores memory_mb
  cores=$(nproc)
  memory_mb=$(awk '/MemAvailable/ {print int($2 / 1024)}' /proc/meminfo)
  local by_memory=$((memory_mb / 1500))
  ((by_memory >= 1)) || by_memory=1
  echo $((cores < by_memory ? cores : by_memory))
}

# build PRESET [-DNAME=VALUE...]: configures where that is not done with these options yet, then builds; the targets in
# RUEDO_TARGETS alone, if that is set.
build() {
  local preset=$1 folder=$ruedo_root/build/$1 options=("${@:2}")
  # Another user's folder, as in a container: what is built is used as it is.
  [[ ! -e $folder/built || -w $folder ]] || return 0
  if command -v ccache >/dev/null; then
    options+=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache -DCMAKE_C_COMPILER_LAUNCHER=ccache)
  fi
  local log=$folder/configure.log option
  local configured=true
  [[ -f $folder/build.ninja ]] || configured=false
  for option in "${options[@]}"; do    # -DNAME=VALUE against the cache's NAME:TYPE=VALUE
    local name=${option#-D}
    grep -qs "^${name%%=*}:[A-Z]*=${option#*=}\$" "$folder/CMakeCache.txt" || configured=false
  done
  if ! $configured; then
    mkdir -p "$folder"
    say "configuring build/$preset"
    (cd "$ruedo_root" && cmake --preset "$preset" "${options[@]}") >"$log" 2>&1 || {
      cat "$log" >&2
      fail "$EXIT_BUILD" "CMake failed; its output is above"
    }
  fi
  [[ -e $folder/built ]] || say "building build/$preset (the first time takes some minutes)"
  local ninja targets
  read -ra targets <<<"${RUEDO_TARGETS:-}"
  ninja=(ninja -C "$folder" -j "$(build_jobs)" "${targets[@]}")
  if [[ -t 2 ]]; then
    "${ninja[@]}" >&2
  else
    "${ninja[@]}" --quiet 2>&1 | sed '/^ninja: no work to do/d' >&2
  fi || fail "$EXIT_BUILD" "the build failed; the lines above say where"
  touch "$folder/built"
}

# Makes "import ruedo" of the virtual environment find the Python client that the release build made.
ensure_python_client() {
  local packages
  packages=$("$ruedo_venv/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
  [[ $(cat "$packages/ruedo-build.pth" 2>/dev/null) == "$ruedo_build/python" ]] || echo "$ruedo_build/python" >"$packages/ruedo-build.pth"
}

# LCM's default multicast group has to be routed somewhere: most machines route it with everything else.
has_multicast_route() {
  "$ruedo_venv/bin/python" -c '
import socket
socket.socket(socket.AF_INET, socket.SOCK_DGRAM).connect(("239.255.76.67", 7667))' 2>/dev/null
}

# Adds a route for LCM over the loopback interface if there is none, and says so. False without the privileges.
ensure_multicast_route() {
  has_multicast_route && return
  local as_root=()
  ((EUID == 0)) || as_root=(sudo -n)
  "${as_root[@]}" ip link set lo up 2>/dev/null
  "${as_root[@]}" ip route add 239.255.76.67/32 dev lo 2>/dev/null
  has_multicast_route && say "there was no multicast route: added one on the loopback interface (ip route add 239.255.76.67/32 dev lo)"
}

# A regular expression of the tests of these tiers (tests/tiers.txt).
tests_of() {
  local names
  names=$(awk -v tiers=" $* " 'index(tiers, " " $1 " ") {for (i = 2; i <= NF; ++i) print $i}' "$ruedo_root/tests/tiers.txt" | paste -sd '|')
  printf '^(%s)$' "$names"
}

# Signs FILE by the key of gpg's in RUEDO_GPG_KEY (FILE.asc) and by minisign's in the file RUEDO_MINISIGN_KEY
# (FILE.minisig), where they are given. Signatures of an earlier FILE go.
sign() {
  rm -f "$1".{asc,minisig}
  if [[ -n ${RUEDO_GPG_KEY:-} ]]; then
    gpg --batch --yes --local-user "$RUEDO_GPG_KEY" --armor --detach-sign "$1" ||
      fail "$EXIT_ENVIRONMENT" "gpg could not sign with the key $RUEDO_GPG_KEY"
  fi
  if [[ -n ${RUEDO_MINISIGN_KEY:-} ]]; then
    minisign -S -s "$RUEDO_MINISIGN_KEY" -m "$1" ||
      fail "$EXIT_ENVIRONMENT" "minisign could not sign with the key in $RUEDO_MINISIGN_KEY"
  fi
}
