#!/usr/bin/env bash
# Draws the figures of docs/paper.md anew: makes the studies of the paper and copies their figures.
set -euo pipefail
cd "$(dirname "$0")/.."
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
cargo run --release -- study studies/paper.toml --out "$out"
mkdir -p docs/images/paper
cp "$out"/figures/*.svg docs/images/paper/
