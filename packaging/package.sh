#!/usr/bin/env bash
# Makes Debian packages of the tree in build/package, with the version of base/version.hpp:
# package.sh [--test: compares their symbols, and uses them in a clean Debian 12]
# SPDX-License-Identifier: Apache-2.0
set -euo pipefail
cd "$(dirname "$0")/.."

need() {  # need PACKAGE...: what an ordinary machine of a developer lacks
  local missing=()
  for package in "$@"; do
    dpkg -s "$package" >/dev/null 2>&1 || missing+=("$package")
  done
  [ ${#missing[@]} -eq 0 ] && return
  echo "./dev package needs ${missing[*]}: sudo apt-get install -y ${missing[*]}" >&2
  exit 1
}

# The tree as git knows it, changes and new files included, so that nothing is built into it.
copy_tree() {  # copy_tree FOLDER
  mkdir -p "$1"
  git ls-files -z --cached --others --exclude-standard |
    while IFS= read -r -d '' file; do if [ -e "$file" ]; then printf '%s\0' "$file"; fi; done |
    tar --create --null --files-from=- | tar --extract --directory="$1"
  cp -a packaging/debian "$1"
}

need debhelper dpkg-dev fakeroot lintian
if [ "${1:-}" = --test ]; then need mmdebstrap abigail-tools; fi
version=$(sed -n 's/.*TAKT_VERSION "\(.*\)"/\1/p' base/version.hpp)
folder=build/package
tree=$folder/takt-$version
mkdir -p $folder
exec 9>"$folder.lock"
flock 9  # one at a time
rm -rf "$tree" $folder/*.deb
copy_tree "$tree"
printf 'takt (%s) unstable; urgency=medium\n\n  * See CHANGELOG.md.\n\n -- %s  %s\n' "$version" \
  "$(sed -n 's/^Maintainer: //p' packaging/debian/control)" "$(git log -1 --format=%cD)" \
  >"$tree/debian/changelog"
echo "builds $tree; its log is $folder/build.log"
# debhelper's HOME is another one, without what was compiled before.
export CCACHE_DIR=${CCACHE_DIR:-$(ccache --get-config cache_dir)}
(cd "$tree" && CCACHE_BASEDIR=$PWD PATH=/usr/lib/ccache:$PATH dpkg-buildpackage -b -us -uc) \
  >$folder/build.log 2>&1 || { tail -30 $folder/build.log >&2; exit 1; }
lintian --fail-on error --tag-display-limit 0 $folder/takt_"$version"_*.changes
ls $folder/*.deb
if [ "${1:-}" = --test ]; then exec packaging/package_test.py $folder; fi
