//! The molecular field eliminated from a force, `F_L M⁻¹ Λ′`, on the rows of one cell.
//!
//! A force without integrals over faces sees the field of its own cell, and so the carried fields of the cell and of
//! its neighbours. One with them sees the fields of the neighbours, too, and with those what lies two faces away.

use nalgebra::DMatrix;

use super::polarity::Polarity;
use crate::solve::blocks::VectorBlocks;
use crate::solve::rows::Rows;

/// `F_L M⁻¹` on the rows of a cell, by the cells whose field the force sees.
pub(super) struct Pushed(Vec<(usize, DMatrix<f64>)>);

impl Pushed {
    /// Of a cell; `by_field` is `F_L`.
    pub fn new(by_field: &Rows, polarity: &Polarity, cell: usize) -> Self {
        let (rows, m) = by_field.size;
        let of = |(seen, block): (usize, &[f64])| {
            let mut pushed = DMatrix::from_row_slice(rows, m, block);
            let inverse = polarity.projection_of(seen);
            for c in [0, m / 2] {
                let part = pushed.columns(c, m / 2) * &inverse;
                pushed.columns_mut(c, m / 2).copy_from(&part);
            }
            (seen, pushed)
        };
        Self(std::iter::once((cell, by_field.own_of(cell))).chain(by_field.off_of(cell)).map(of).collect())
    }

    /// `F_L M⁻¹ Λ′` by the carried field on the cell `other`, Λ′ along the polarity.
    pub fn by_polarity<'a>(&'a self, well: &'a VectorBlocks, other: usize) -> impl Iterator<Item = DMatrix<f64>> + 'a {
        self.0.iter().filter_map(move |(seen, pushed)| well.left_product(pushed, *seen, other))
    }

    /// `F_L M⁻¹ Λ′` by the carried field on the cell `other`, Λ′ along the density.
    pub fn by_density<'a>(&'a self, well: &'a Rows, other: usize) -> impl Iterator<Item = DMatrix<f64>> + 'a {
        let (m, n) = well.size;
        self.0
            .iter()
            .filter_map(move |(seen, pushed)| Some(pushed * DMatrix::from_row_slice(m, n, well.block(*seen, other)?)))
    }
}
