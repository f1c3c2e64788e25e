#!/usr/bin/env bash
# Draws the figures of docs/paper.md and docs/bounds.md anew: makes the studies of the paper and curves of bounds, and copies
# their figures. The last one needs Python with matplotlib and the package supple.
set -euo pipefail
cd "$(dirname "$0")/.."
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
# 1: roll-outs contradict the paper's door, as the page says.
cargo run --release --features figures -- study studies/paper.toml --out "$out" || [ $? = 1 ]
mkdir -p docs/images/paper docs/images/bounds
cp "$out"/figures/*.svg docs/images/paper/
cargo run --release --features figures -- bound tasks/tanaka_plant.toml --stationary --cost 40 --curve=40 --out "$out/plant"
cargo run --release --features figures -- bound tasks/two_mass.toml --set k1=135.912 --set k2=171.458 --curve=24 --out "$out/masses"
for name in plant masses; do
    cargo run --release --features figures -- plot "$out/$name" --figure bound --out "docs/images/bounds/$name.svg"
done
mkdir -p docs/images/aims
python docs/three_designs.py docs/images/aims/three.svg
