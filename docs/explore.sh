#!/usr/bin/env bash
# Takes the pictures of docs/explore.md: a walk through the explorer in headless Chromium. It needs Chromium, chromedriver and
# the packages of tests/browser/requirements.txt.
set -euo pipefail
cd "$(dirname "$0")/.."
cargo build --release -p supple-cli
python3 docs/explore_walk.py docs/images
