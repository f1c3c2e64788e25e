//! Figures for papers: vector graphics with labels and units, safe for colour-blind readers.
