#!/usr/bin/env bash
# The tests of the rasterizer on a core built with sanitizers: run.sh [pytest's arguments]
# First AddressSanitizer and UBSan, then ThreadSanitizer; SANITIZERS="thread" runs the latter alone.
# The builds lie in build/sanitize, each with a virtual environment over the packages of .venv; what is installed stays.
set -euo pipefail
cd "$(dirname "$0")/../.."
base=$PWD/.venv

find_packages() { "$1/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))'; }

build() { # the core with the sanitizers $1 in an environment in the folder $2
  [ -x "$2/bin/python" ] || "$base/bin/python" -m venv --without-pip "$2"
  local packages
  packages=$(find_packages "$2")
  find_packages "$base" > "$packages/base.pth"
  "$base/bin/python" -m pip install --quiet --disable-pip-version-check --no-build-isolation --no-deps --upgrade \
    --target "$packages" . --config-settings=cmake.define.SANITIZE="$1" --config-settings=build-dir="$2/cmake" \
    --config-settings=cmake.define.OPENMP_RUNTIME="$PWD/tests/sanitizers/openmp_on_threads.cpp"
}

export ASAN_OPTIONS=detect_leaks=0:allocator_may_return_null=1 # Python's own leaks are not the core's
export UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1
# only the core is built for it: in other libraries it cannot see what keeps threads apart
export TSAN_OPTIONS=ignore_noninstrumented_modules=1:exitcode=66:report_signal_unsafe=0
for sanitizers in ${SANITIZERS:-address,undefined thread}; do
  folder=$PWD/build/sanitize/$sanitizers libraries=
  build "$sanitizers" "$folder"
  for name in ${sanitizers//,/ }; do
    case $name in address) name=asan ;; undefined) name=ubsan ;; thread) name=tsan ;; esac
    libraries+="$(g++ -print-file-name=lib$name.so) "
  done
  echo "$sanitizers:"
  LD_PRELOAD=$libraries "$folder/bin/python" -m pytest -q -p no:cacheprovider "${@:-tests/unit/raster}"
done
