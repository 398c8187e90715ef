//! The slenderness field of a part: D1, D2, ratio, summary and histograms.
