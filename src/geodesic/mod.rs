//! D1: geodesic distances by the heat method, and the farthest distance of every vertex.
pub mod exact;
