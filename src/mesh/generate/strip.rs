//! The strip.

use super::keys::{Meaning, keyed};
use super::outline::{Outline, Piece, line};
use super::rules::{self, Check, bad};
use super::size::Size;
use super::stretch::{STRETCH, Stretch};
use super::triangulated::Plan;
use super::{Domain, Named, Scale};
use crate::mesh::{Mesh, MeshError, Point};

keyed! {
    /// Rectangle `length × [−width/2, width/2]`.
    Strip {
        /// Extent along x₁, `[x₀, x₁]`.
        length: [f64; 2] => Meaning::Interval;
        /// Extent across the strip or the band.
        width: f64 => Meaning::Length;
        /// Edge length.
        h: f64 => Meaning::Edge;
        /// Cells are this much longer along x₁ than across.
        stretch: f64 = 1.0 => STRETCH;
        /// The mesh is its own exact mirror image in x₂ = 0.
        symmetric: bool = false => Meaning::Free;
    }
}

impl Named for Strip {
    const NAME: &'static str = "strip";
}

impl Strip {
    fn size(&self) -> Size {
        Size::even(self.h)
    }

    fn area(&self) -> f64 {
        let [x0, x1] = self.length;
        (x1 - x0) * self.width / self.stretch
    }
}

impl Domain for Strip {
    fn tags(&self) -> &'static [&'static str] {
        &["inlet", "outlet", "walls"]
    }

    fn check(&self) -> Check {
        check_sides(self.length, self.width, self.h, self.symmetric)?;
        let ([x0, x1], stretch) = (self.length, self.stretch);
        let cell = self.h * stretch;
        if cell > x1 - x0 {
            let rule = format!("one cell, h·stretch = {cell:?} long, must fit into the length {:?}", x1 - x0);
            return Err(bad("stretch", format!("{stretch:?}"), rule, "choose a smaller stretch or a longer strip"));
        }
        rules::not_too_many(&self.size(), self.expected(), self.expected())
    }

    fn build(&self) -> Result<Mesh, MeshError> {
        let stretch = Stretch::new(self.length, self.stretch, &self.size());
        let outline = rectangle(Outline::new(self.tags()), stretch.image(), self.width, self.symmetric, None);
        Plan { outline, size: self.size(), symmetric: self.symmetric, stretch, curved: 1 }.build()
    }

    fn expected(&self) -> f64 {
        self.size().far(self.area())
    }

    fn bounds(&self) -> [[f64; 2]; 2] {
        [self.length, [-0.5 * self.width, 0.5 * self.width]]
    }

    fn scale(&self) -> Scale {
        Scale::Across(self.width)
    }
}

/// Edges fit into a strip of this length and width.
pub(super) fn check_sides([x0, x1]: [f64; 2], width: f64, h: f64, symmetric: bool) -> Check {
    rules::resolves("h", h, "width", width)?;
    if h > x1 - x0 {
        let rule = format!("it must not exceed the length {:?}", x1 - x0);
        return Err(bad("h", format!("{h:?}"), rule, "choose a smaller h"));
    }
    if symmetric && h > 0.5 * width {
        let rule = format!("it must not exceed half the width {width:?} of a symmetric strip");
        return Err(bad("h", format!("{h:?}"), rule, "choose a smaller h"));
    }
    Ok(())
}

/// The outline of a strip, or of its upper half, with a disc taken out; tags in the order inlet, outlet, walls, disc.
pub(super) fn rectangle(
    mut outline: Outline,
    [x0, x1]: [f64; 2],
    width: f64,
    half: bool,
    disc: Option<(Point, f64)>,
) -> Outline {
    let top = 0.5 * width;
    let bottom = if half { 0.0 } else { -top };
    let [a, b] = [Point::new(x0, bottom), Point::new(x1, bottom)];
    let [c, d] = [Point::new(x1, top), Point::new(x0, top)];
    let mut rim: Vec<Piece> = match (half, disc) {
        (false, None) => vec![line(a, b, Some(2))],
        (true, None) => vec![line(a, b, None)],
        (false, Some((centre, radius))) => {
            let hole = outline.circle(centre, radius, 3);
            outline.loops.push(hole);
            vec![line(a, b, Some(2))]
        }
        (true, Some((centre, radius))) => {
            let curve = outline.curve(centre, radius);
            let over = outline.arc(curve, std::f64::consts::PI, -std::f64::consts::PI, 3);
            vec![line(a, over.from, None), over, line(over.to, b, None)]
        }
    };
    rim.extend([line(b, c, Some(1)), line(c, d, Some(2)), line(d, a, Some(0))]);
    outline.loops.push(rim);
    outline
}
