//! D2: widths by ray shooting.
