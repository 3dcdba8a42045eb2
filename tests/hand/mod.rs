//! Small meshes made by hand.

// Each test file uses some of them.
#![allow(dead_code)]

use monolayer::mesh::{BoundaryEdge, Curve, Mesh, Point};

/// The square `[−1, 1]²`, stretched by `stretch`: `2 n²` cells, tags `left`, `right`, `bottom`, `top`.
pub fn square(n: usize, stretch: [f64; 2]) -> Mesh {
    let at = |k: usize| 2.0 * k as f64 / n as f64 - 1.0;
    let place = |k: usize| Point::new(at(k % (n + 1)) * stretch[0], at(k / (n + 1)) * stretch[1]);
    let id = |i: usize, j: usize| j * (n + 1) + i;
    let vertices = (0..(n + 1) * (n + 1)).map(place).collect();
    let (mut cells, mut boundary) = (Vec::new(), Vec::new());
    for j in 0..n {
        for i in 0..n {
            cells.push([id(i, j), id(i + 1, j), id(i + 1, j + 1)]);
            cells.push([id(i, j), id(i + 1, j + 1), id(i, j + 1)]);
        }
        let sides =
            [[id(0, j), id(0, j + 1)], [id(n, j), id(n, j + 1)], [id(j, 0), id(j + 1, 0)], [id(j, n), id(j + 1, n)]];
        let edge = |(tag, vertices)| BoundaryEdge { vertices, tag, curve: None };
        boundary.extend(sides.into_iter().enumerate().map(edge));
    }
    let tags = ["left", "right", "bottom", "top"].map(String::from).to_vec();
    Mesh::build(vertices, cells, &boundary, tags, Vec::new()).unwrap()
}

/// The disc about (0.3, −0.2) of radius 1.5: `rings` rings of `sectors` sectors, tag `wall`, bent to `degree`.
pub fn disc(rings: usize, sectors: usize, degree: usize) -> Mesh {
    let (centre, radius) = (Point::new(0.3, -0.2), 1.5);
    let mut vertices = vec![centre];
    let mut cells = Vec::new();
    let id = |ring: usize, sector: usize| 1 + (ring - 1) * sectors + sector % sectors;
    for ring in 1..=rings {
        for sector in 0..sectors {
            let angle = std::f64::consts::TAU * sector as f64 / sectors as f64;
            vertices.push(centre + Point::new(angle.cos(), angle.sin()) * (radius * ring as f64 / rings as f64));
            let (a, b) = (id(ring, sector), id(ring, sector + 1));
            if ring == 1 {
                cells.push([0, a, b]);
            } else {
                let (c, d) = (id(ring - 1, sector), id(ring - 1, sector + 1));
                cells.extend([[c, a, b], [c, b, d]]);
            }
        }
    }
    let edge = |k| BoundaryEdge { vertices: [id(rings, k), id(rings, k + 1)], tag: 0, curve: Some(0) };
    let boundary: Vec<_> = (0..sectors).map(edge).collect();
    let curves = vec![Curve::Circle { centre, radius }];
    let mut mesh = Mesh::build(vertices, cells, &boundary, vec!["wall".to_owned()], curves).unwrap();
    mesh.bend(degree).unwrap();
    mesh
}
