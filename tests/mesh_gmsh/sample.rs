//! Small files in all versions of the format, as Gmsh writes them.

use std::collections::BTreeMap;

/// Order of bytes, or text.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Form {
    Text,
    Little,
    Big,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Version {
    Two,
    Four,
    FourOne,
}

pub const VERSIONS: [Version; 3] = [Version::Two, Version::Four, Version::FourOne];
pub const FORMS: [Form; 3] = [Form::Text, Form::Little, Form::Big];

/// A mesh as it stands in a file: nodes from 1, entities with their groups.
#[derive(Debug, Clone)]
pub struct Sample {
    pub degree: usize,
    pub nodes: Vec<[f64; 3]>,
    /// Entity and nodes.
    pub lines: Vec<(i32, Vec<usize>)>,
    pub triangles: Vec<(i32, Vec<usize>)>,
    /// Node numbers of point elements.
    pub points: Vec<usize>,
    /// Groups by dimension and entity.
    pub groups: BTreeMap<(i32, i32), Vec<i32>>,
    /// Dimension, group, name.
    pub names: Vec<(i32, i32, &'static str)>,
    pub parametric: bool,
    /// Text between nodes and elements, and at the end.
    pub extra: [&'static str; 2],
}

impl Sample {
    /// The rectangle 2 × 1 as two squares of two triangles each, which share the curve 5; curves 1 to 4 are its
    /// bottom, right, top and left side. The right side bulges by `bulge` if the degree allows it.
    pub fn rectangle(degree: usize, bulge: f64) -> Self {
        let corners = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [0.0, 1.0]];
        let mut sample = Self {
            degree,
            nodes: corners.iter().map(|[x, y]| [*x, *y, 0.0]).collect(),
            lines: Vec::new(),
            triangles: Vec::new(),
            points: vec![1, 3],
            groups: [((1, 1), vec![3]), ((1, 2), vec![2]), ((1, 3), vec![3]), ((1, 4), vec![1])].into(),
            names: vec![(1, 1, "in let"), (1, 2, "outlet"), (1, 3, "walls"), (2, 9, "tissue")],
            parametric: false,
            extra: ["", ""],
        };
        sample.groups.extend([((2, 1), vec![9]), ((2, 2), vec![9])]);
        let mut edges = BTreeMap::new();
        for (entity, [a, b, c]) in [(1, [1, 2, 5]), (1, [1, 5, 6]), (2, [2, 3, 4]), (2, [2, 4, 5])] {
            let mut nodes = vec![a, b, c];
            for [p, q] in [[a, b], [b, c], [c, a]] {
                nodes.extend(sample.inner([p, q], &mut edges, bulge));
            }
            if degree == 3 {
                let mean = |k: usize| {
                    nodes[3..9].iter().map(|n| sample.nodes[n - 1][k]).sum::<f64>() / 4.0
                        - [a, b, c].iter().map(|n| sample.nodes[n - 1][k]).sum::<f64>() / 6.0
                };
                let middle = [mean(0), mean(1), 0.0];
                sample.nodes.push(middle);
                nodes.push(sample.nodes.len());
            }
            sample.triangles.push((entity, nodes));
        }
        let curves = [(1, [1, 2]), (1, [2, 3]), (2, [3, 4]), (3, [4, 5]), (3, [5, 6]), (4, [6, 1]), (5, [2, 5])];
        for (entity, ends) in curves {
            let inner = sample.inner(ends, &mut edges, bulge);
            sample.lines.push((entity, [ends.to_vec(), inner].concat()));
        }
        sample
    }

    /// Nodes inside of an edge, in its direction.
    fn inner(&mut self, [p, q]: [usize; 2], edges: &mut BTreeMap<[usize; 2], Vec<usize>>, bulge: f64) -> Vec<usize> {
        if let Some(known) = edges.get(&[q, p]) {
            return known.iter().rev().copied().collect();
        }
        if let Some(known) = edges.get(&[p, q]) {
            return known.clone();
        }
        let (a, b) = (self.nodes[p - 1], self.nodes[q - 1]);
        let right = a[0] == 2.0 && b[0] == 2.0;
        let made = (1..self.degree).map(|k| {
            let s = k as f64 / self.degree as f64;
            let out = if right { 4.0 * bulge * s * (1.0 - s) } else { 0.0 };
            self.nodes.push([a[0] + (b[0] - a[0]) * s + out, a[1] + (b[1] - a[1]) * s, 0.0]);
            self.nodes.len()
        });
        let made: Vec<usize> = made.collect();
        edges.insert([p, q], made.clone());
        made
    }

    pub fn bytes(&self, version: Version, form: Form) -> Vec<u8> {
        let mut sink = Sink { bytes: Vec::new(), form };
        let number = ["2.2", "4", "4.1"][version as usize];
        sink.text(&format!("$MeshFormat\n{number} {} 8\n", u8::from(form != Form::Text)));
        if form != Form::Text {
            sink.int(1);
            sink.text("\n");
        }
        sink.text("$EndMeshFormat\n");
        if !self.names.is_empty() {
            sink.text(&format!("$PhysicalNames\n{}\n", self.names.len()));
            self.names.iter().for_each(|(dim, group, name)| sink.text(&format!("{dim} {group} \"{name}\"\n")));
            sink.text("$EndPhysicalNames\n");
        }
        match version {
            Version::Two => self.two(&mut sink),
            Version::Four | Version::FourOne => self.four(&mut sink, version),
        }
        sink.text(self.extra[1]);
        sink.bytes
    }

    /// Type numbers of points, lines and triangles.
    fn kinds(&self) -> [i32; 3] {
        [15, [1, 8, 26][self.degree - 1], [2, 9, 21][self.degree - 1]]
    }

    /// Dimension, entity, nodes of all elements.
    fn elements(&self) -> Vec<(i32, i32, Vec<usize>)> {
        let points = self.points.iter().map(|&node| (0, node as i32, vec![node]));
        let lines = self.lines.iter().map(|(entity, nodes)| (1, *entity, nodes.clone()));
        let triangles = self.triangles.iter().map(|(entity, nodes)| (2, *entity, nodes.clone()));
        points.chain(lines).chain(triangles).collect()
    }

    fn two(&self, sink: &mut Sink) {
        let section = if self.parametric { "ParametricNodes" } else { "Nodes" };
        sink.text(&format!("${section}\n{}\n", self.nodes.len()));
        for (k, x) in self.nodes.iter().enumerate() {
            sink.int(k as i32 + 1);
            x.iter().for_each(|&value| sink.real(value));
            if self.parametric {
                // on a curve, with one parameter
                [1, 1].into_iter().for_each(|value| sink.int(value));
                sink.real(0.5);
            }
            sink.end_line();
        }
        sink.end_of_data();
        sink.text(&format!("$End{section}\n{}", self.extra[0]));
        let all: Vec<(i32, i32, i32, Vec<usize>)> = self
            .elements()
            .into_iter()
            .flat_map(|(dim, entity, nodes)| {
                let groups = self.groups.get(&(dim, entity)).cloned().unwrap_or_else(|| vec![0]);
                groups.into_iter().map(move |group| (dim, group, entity, nodes.clone()))
            })
            .collect();
        sink.text(&format!("$Elements\n{}\n", all.len()));
        for (number, (dim, group, entity, nodes)) in all.iter().enumerate() {
            let kind = self.kinds()[*dim as usize];
            let head = if sink.form == Form::Text {
                vec![number as i32 + 1, kind, 2]
            } else {
                vec![kind, 1, 2, number as i32 + 1]
            };
            head.into_iter().chain([*group, *entity]).for_each(|value| sink.int(value));
            nodes.iter().for_each(|&node| sink.int(node as i32));
            sink.end_line();
        }
        sink.end_of_data();
        sink.text("$EndElements\n");
    }

    fn four(&self, sink: &mut Sink, version: Version) {
        let new = version == Version::FourOne;
        sink.text("$Entities\n");
        [2, 5, 2, 0].into_iter().for_each(|count| sink.size(count));
        sink.end_line();
        for (dim, entity) in [(0, 1), (0, 3)].into_iter().chain((1..6).map(|e| (1, e))).chain([(2, 1), (2, 2)]) {
            sink.int(entity);
            (0..if dim == 0 && new { 3 } else { 6 }).for_each(|_| sink.real(1e22));
            let groups = self.groups.get(&(dim, entity)).cloned().unwrap_or_default();
            sink.size(groups.len());
            groups.into_iter().for_each(|group| sink.int(group));
            if dim > 0 {
                sink.size(2);
                [1, -2].into_iter().for_each(|value| sink.int(value));
            }
            sink.end_line();
        }
        sink.end_of_data();
        sink.text("$EndEntities\n$Nodes\n");
        let n = self.nodes.len();
        [1, n].into_iter().chain(new.then_some([1, n]).into_iter().flatten()).for_each(|count| sink.size(count));
        sink.end_line();
        let place = if new { [2, 1] } else { [1, 2] };
        place.into_iter().chain([i32::from(self.parametric)]).for_each(|value| sink.int(value));
        sink.size(n);
        sink.end_line();
        if new {
            (1..=n).for_each(|node| {
                sink.size(node);
                sink.end_line();
            });
        }
        for (k, x) in self.nodes.iter().enumerate() {
            if !new {
                sink.int(k as i32 + 1);
            }
            x.iter().for_each(|&value| sink.real(value));
            if self.parametric {
                [0.25, 0.75].into_iter().for_each(|value| sink.real(value));
            }
            sink.end_line();
        }
        sink.end_of_data();
        sink.text(&format!("$EndNodes\n{}$Elements\n", self.extra[0]));
        let all = self.elements();
        let total = all.len();
        [total, total]
            .into_iter()
            .chain(new.then_some([1, total]).into_iter().flatten())
            .for_each(|count| sink.size(count));
        sink.end_line();
        for (number, (dim, entity, nodes)) in all.into_iter().enumerate() {
            let place = if new { [dim, entity] } else { [entity, dim] };
            place.into_iter().chain([self.kinds()[dim as usize]]).for_each(|value| sink.int(value));
            sink.size(1);
            sink.end_line();
            let numbers = [number + 1].into_iter().chain(nodes);
            numbers.for_each(|value| if new { sink.size(value) } else { sink.int(value as i32) });
            sink.end_line();
        }
        sink.end_of_data();
        sink.text("$EndElements\n");
    }
}

struct Sink {
    bytes: Vec<u8>,
    form: Form,
}

impl Sink {
    fn text(&mut self, text: &str) {
        self.bytes.extend_from_slice(text.as_bytes());
    }

    fn put<const N: usize>(&mut self, shown: &str, mut little: [u8; N]) {
        match self.form {
            Form::Text => self.text(&format!("{shown} ")),
            Form::Little => self.bytes.extend(little),
            Form::Big => {
                little.reverse();
                self.bytes.extend(little);
            }
        }
    }

    fn int(&mut self, value: i32) {
        self.put(&value.to_string(), value.to_le_bytes());
    }

    fn size(&mut self, value: usize) {
        self.put(&value.to_string(), (value as u64).to_le_bytes());
    }

    fn real(&mut self, value: f64) {
        self.put(&format!("{value:?}"), value.to_le_bytes());
    }

    fn end_line(&mut self) {
        if self.form == Form::Text {
            self.text("\n");
        }
    }

    fn end_of_data(&mut self) {
        if self.form != Form::Text {
            self.text("\n");
        }
    }
}
