//! Mesh files to raw buffers, and results to coloured PLY. No geometry here.
