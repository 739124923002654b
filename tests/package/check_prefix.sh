#!/usr/bin/env bash
# usage: check_prefix.sh PREFIX SOURCE BUILD CONFIG
# An installed tree must not point back to where it was built. Libraries are searched too, unless
# they carry debug information, which names sources by design.
set -euo pipefail

prefix=$1 source=$2 build=$3 config=$4
test -f "$prefix/include/flyball/core/error.hpp"
test -f "$prefix/include/flyball/core/version.hpp"

options=(--recursive --fixed-strings --files-with-matches -e "$source/" -e "$build/")
if [[ $config != Release && $config != MinSizeRel ]]; then
  options+=(--binary-files=without-match)
fi
# The search can find: the build tree does name its source.
grep "${options[@]}" "$build/CMakeCache.txt" >/dev/null
if found=$(grep "${options[@]}" "$prefix"); then
  echo "These installed files name the source or build tree:" >&2
  echo "$found" >&2
  exit 1
fi
