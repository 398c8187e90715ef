//! Small formulas on points and triangles.

/// A point or vector, model units.
pub type Vec3 = [f64; 3];

/// a - b
pub fn sub(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// a + b
pub fn add(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// s a
pub fn scale(a: Vec3, s: f64) -> Vec3 {
    [a[0] * s, a[1] * s, a[2] * s]
}

/// a · b
pub fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// a × b
pub fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// |a|
pub fn norm(a: Vec3) -> f64 {
    dot(a, a).sqrt()
}

/// |a - b|
pub fn distance(a: Vec3, b: Vec3) -> f64 {
    norm(sub(a, b))
}

/// The corners of a triangle.
pub fn corners(positions: &[Vec3], triangle: [u32; 3]) -> [Vec3; 3] {
    triangle.map(|v| positions[v as usize])
}

/// Normal of a triangle (right-hand rule), twice its area long.
pub fn area_vector([a, b, c]: [Vec3; 3]) -> Vec3 {
    cross(sub(b, a), sub(c, a))
}

/// Area of a triangle.
pub fn area(triangle: [Vec3; 3]) -> f64 {
    0.5 * norm(area_vector(triangle))
}

/// True for a triangle that has no usable normal: its height is below rounding, 1e-14 of its longest side.
pub fn is_flat(triangle: [Vec3; 3]) -> bool {
    let [a, b, c] = triangle;
    let longest = distance(a, b).max(distance(b, c)).max(distance(c, a));
    // `!(x > y)` so that a NaN counts as flat
    !(norm(area_vector(triangle)) > 1e-14 * longest * longest)
}

/// Six times the signed volume of the tetrahedron (origin, triangle); the sum over a closed outward-oriented surface is
/// six times its volume.
pub fn signed_volume6([a, b, c]: [Vec3; 3], origin: Vec3) -> f64 {
    dot(sub(a, origin), cross(sub(b, origin), sub(c, origin)))
}

/// Barycentric coordinates of a point of a triangle, not negative; those of its centroid if it has no area.
pub fn barycentric(triangle: [Vec3; 3], p: Vec3) -> [f64; 3] {
    let [a, b, c] = triangle;
    let normal = area_vector(triangle);
    let share = |u: Vec3, v: Vec3| (dot(cross(sub(u, p), sub(v, p)), normal) / dot(normal, normal)).max(0.0);
    let weights = [share(b, c), share(c, a), share(a, b)];
    if weights.iter().sum::<f64>() > 0.0 { weights } else { [1.0 / 3.0; 3] }
}

/// The point of a triangle with these barycentric coordinates, which sum to 1.
pub fn at_weights([a, b, c]: [Vec3; 3], weights: [f64; 3]) -> Vec3 {
    add(add(scale(a, weights[0]), scale(b, weights[1])), scale(c, weights[2]))
}

/// Smallest box with sides along the axes, `(lower, upper)` corners; (+inf, -inf) when there are no points.
pub fn bounding_box(points: impl Iterator<Item = Vec3>) -> (Vec3, Vec3) {
    points.fold(([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]), |(mut lo, mut hi), p| {
        for k in 0..3 {
            lo[k] = lo[k].min(p[k]);
            hi[k] = hi[k].max(p[k]);
        }
        (lo, hi)
    })
}
