//! Multifrontal LU factorisation (Duff and Reid 1983) of a sum of dense element matrices, along an elimination tree.
//!
//! Every tree node owns a dense front `[F11 F12; F21 F22]`. It is summed from element entries and from the children's
//! Schur complements; its pivots are eliminated with row exchanges inside `F11`, and `F22 − F21 F11⁻¹ F12` goes to the
//! parent.

use std::sync::{Arc, Mutex};

use rayon::prelude::*;

use super::SolveError;
pub use super::front::Real;
use super::front::{Factors, solve_lower, solve_upper, subtract_product};
use super::symbolic::{Element, Front, Symbolic};

/// Subtrees with fewer operations are factorised on one thread.
const PARALLEL_FACTORISATION: f64 = 2e6;
/// Subtrees with fewer operations (of the factorisation) are solved with on one thread.
const PARALLEL_SOLVE: f64 = 1e8;

/// What factors are kept in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// 24 bits: half the memory and half the time, for a preconditioner.
    Single,
    /// 53 bits.
    Double,
}

impl Precision {
    /// Bytes of a number.
    pub fn bytes(self) -> usize {
        match self {
            Self::Single => 4,
            Self::Double => 8,
        }
    }
}

/// The factors of a matrix, in double precision or, as a preconditioner of half the size, in single precision.
pub struct Multifrontal<T = f64> {
    symbolic: Arc<Symbolic>,
    factors: Vec<Factors<T>>,
    /// The fronts' Schur complements, for those who change a few elements again and again.
    kept: Option<Vec<Vec<T>>>,
}

impl<T> std::fmt::Debug for Multifrontal<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Multifrontal").field("symbolic", &self.symbolic).finish_non_exhaustive()
    }
}

impl<T: Real> Multifrontal<T> {
    /// Factorises the sum of the elements. `fill(e, element)` sets all of element `e`, with the rows and columns that
    /// [`Symbolic::new`] was told, or some of them; it is called once per element or little more often, from any
    /// thread.
    ///
    /// # Errors
    /// A pivot is zero to rounding or not finite.
    pub fn new(symbolic: Arc<Symbolic>, fill: impl Fn(usize, &mut Element) + Sync) -> Result<Self, SolveError> {
        let factors = symbolic.fronts.iter().map(|f| Factors::new(f.pivots(), f.boundary.len())).collect();
        let mut multifrontal = Self { symbolic, factors, kept: None };
        multifrontal.refactor(fill)?;
        Ok(multifrontal)
    }

    /// As [`Multifrontal::new`], ready for [`Multifrontal::refactor_changed`]: the Schur complements of all fronts are
    /// kept too.
    ///
    /// # Errors
    /// A pivot is zero to rounding or not finite.
    pub fn keeping(symbolic: Arc<Symbolic>, fill: impl Fn(usize, &mut Element) + Sync) -> Result<Self, SolveError> {
        let factors = symbolic.fronts.iter().map(|f| Factors::new(f.pivots(), f.boundary.len())).collect();
        let kept = symbolic.fronts.iter().map(|f| vec![T::of(0.0); f.boundary.len().pow(2)]).collect();
        let mut multifrontal = Self { symbolic, factors, kept: Some(kept) };
        let every: Vec<usize> = (0..multifrontal.symbolic.visits.len()).collect();
        multifrontal.refactor_changed(fill, &every)?;
        Ok(multifrontal)
    }

    /// Factorises anew the fronts that need one of the elements `changed`, and those above them; the others keep their
    /// factors and Schur complements. The factors are those of [`Multifrontal::new`], bit by bit. Returns the share of
    /// the operations that was done.
    ///
    /// # Errors
    /// A pivot is zero to rounding or not finite.
    ///
    /// # Panics
    /// When the factors were not made by [`Multifrontal::keeping`].
    pub fn refactor_changed(
        &mut self,
        fill: impl Fn(usize, &mut Element) + Sync,
        changed: &[usize],
    ) -> Result<f64, SolveError> {
        let mut touched = vec![false; self.symbolic.visits.len()];
        changed.iter().for_each(|&e| touched[e] = true);
        let fronts = &self.symbolic.fronts;
        let mut old = vec![true; fronts.len()];
        for (node, front) in fronts.iter().enumerate() {
            old[node] = front.children.iter().all(|&c| old[c]) && !front.elements.iter().any(|&e| touched[e as usize]);
        }
        self.renew_all_but(&old, fill)
    }

    /// As [`Multifrontal::refactor_changed`] for a matrix that couples other unknowns in places: fronts with the same
    /// unknowns, elements and fronts below keep their factors. Elements of one number must be the same, but for those
    /// `changed`.
    ///
    /// # Errors
    /// A pivot is zero to rounding or not finite.
    ///
    /// # Panics
    /// When the factors were not made by [`Multifrontal::keeping`].
    pub fn restructure(
        &mut self,
        symbolic: Arc<Symbolic>,
        fill: impl Fn(usize, &mut Element) + Sync,
        changed: &[usize],
    ) -> Result<f64, SolveError> {
        let mut touched = vec![false; symbolic.visits.len()];
        changed.iter().for_each(|&e| touched[e] = true);
        let same = symbolic.fronts_as_in(&self.symbolic, &touched);
        let mut kept = self.kept.take().expect("the factors were made by `keeping`");
        let mut factors = std::mem::take(&mut self.factors);
        for (front, same) in symbolic.fronts.iter().zip(&same) {
            let (p, b) = (front.pivots(), front.boundary.len());
            self.factors.push(same.map_or_else(|| Factors::new(p, b), |k| std::mem::take(&mut factors[k])));
        }
        let schur = symbolic.fronts.iter().zip(&same).map(|(front, same)| match same {
            Some(k) => std::mem::take(&mut kept[*k]),
            None => vec![T::of(0.0); front.boundary.len().pow(2)],
        });
        (self.kept, self.symbolic) = (Some(schur.collect()), symbolic);
        let old: Vec<bool> = same.iter().map(Option::is_some).collect();
        self.renew_all_but(&old, fill)
    }

    /// Factorises the fronts that are not `old`, all above one of them among these.
    fn renew_all_but(&mut self, old: &[bool], fill: impl Fn(usize, &mut Element) + Sync) -> Result<f64, SolveError> {
        super::sparse::count(1, 0);
        let symbolic = &*self.symbolic;
        let kept = self.kept.as_mut().expect("the factors were made by `keeping`");
        let (mut left, mut work) = (vec![0; symbolic.visits.len()], 0.0);
        for front in symbolic.fronts.iter().zip(old).filter(|(_, old)| !**old).map(|(front, _)| front) {
            front.elements.iter().for_each(|&e| left[e as usize] += 1);
            work += front.flops();
        }
        let parked = left.into_iter().map(|left| Mutex::new(Parked { left, element: None })).collect();
        let assembly = Assembly { symbolic, fill, parked };
        assembly.renew(symbolic.fronts.len() - 1, &mut self.factors, kept, old)?;
        Ok(work / symbolic.flops().max(1.0))
    }

    /// Factorises new values in the memory of the old factors; after an error, the factors are of no use.
    ///
    /// # Errors
    /// A pivot is zero to rounding or not finite.
    pub fn refactor(&mut self, fill: impl Fn(usize, &mut Element) + Sync) -> Result<(), SolveError> {
        super::sparse::count(1, 0);
        let symbolic = &*self.symbolic;
        let parked = symbolic.visits.iter().map(|&left| Mutex::new(Parked { left, element: None })).collect();
        let assembly = Assembly { symbolic, fill, parked };
        assembly.factorise(symbolic.fronts.len() - 1, &mut self.factors).map(drop)
    }

    /// The structure, to be shared with other factorisations.
    pub fn symbolic(&self) -> &Arc<Symbolic> {
        &self.symbolic
    }

    /// `x ← A⁻¹ x`.
    ///
    /// # Panics
    /// When `x` has not the order of the matrix.
    pub fn solve_in_place(&self, x: &mut [f64]) {
        super::sparse::count(0, 1);
        self.sweep(x, |f, x, y| f.forward(x, y), |f, x, y| f.backward(x, y));
    }

    /// Up and down the tree; both steps work on a front's pivots and on its boundary.
    fn sweep(&self, x: &mut [f64], up: impl Step<T>, down: impl Step<T>) {
        let symbolic = &*self.symbolic;
        assert_eq!(x.len(), symbolic.unknowns(), "a vector must have the order of the matrix");
        let unit = T::unit_of(x);
        let mut places: Vec<T> = symbolic.order.iter().map(|&u| T::of(x[u as usize] / unit)).collect();
        let root = symbolic.fronts.len() - 1;
        self.ascend(root, &mut places, &up);
        self.descend(root, &mut places, &[], &down);
        x.par_chunks_mut(4096).zip(symbolic.place.par_chunks(4096)).for_each(|(x, place)| {
            x.iter_mut().zip(place).for_each(|(x, &k)| *x = unit * places[k as usize].value());
        });
    }

    /// Solves forward in a subtree with the places `x`; returns what is to be added to the boundary.
    fn ascend(&self, node: usize, x: &mut [T], step: &impl Step<T>) -> Vec<T> {
        let front = &self.symbolic.fronts[node];
        let (below, pivots) = x.split_at_mut(front.start - front.lowest);
        let parts = split(&self.symbolic.fronts, front, below, |child| child.end - child.lowest);
        let updates = each(parts, front.work > PARALLEL_SOLVE, |(child, x)| self.ascend(child, x, step));
        let mut boundary = vec![T::of(0.0); front.boundary.len()];
        let p = front.pivots();
        for (&child, update) in front.children.iter().zip(updates) {
            for (&row, value) in self.symbolic.fronts[child].into_parent.iter().zip(update) {
                let row = row as usize;
                *(if row < p { &mut pivots[row] } else { &mut boundary[row - p] }) += value;
            }
        }
        step(&self.factors[node], pivots, &mut boundary);
        boundary
    }

    /// Solves backward in a subtree, given the solution on the boundary.
    fn descend(&self, node: usize, x: &mut [T], boundary: &[T], step: &impl Step<T>) {
        let front = &self.symbolic.fronts[node];
        let (below, pivots) = x.split_at_mut(front.start - front.lowest);
        let mut boundary = boundary.to_vec();
        step(&self.factors[node], pivots, &mut boundary);
        let p = front.pivots();
        let parts = split(&self.symbolic.fronts, front, below, |child| child.end - child.lowest);
        let (pivots, boundary) = (&*pivots, &*boundary);
        each(parts, front.work > PARALLEL_SOLVE, |(child, x)| {
            let rows = self.symbolic.fronts[child].into_parent.iter().map(|&row| row as usize);
            let known: Vec<T> = rows.map(|r| if r < p { pivots[r] } else { boundary[r - p] }).collect();
            self.descend(child, x, &known, step);
        });
    }
}

/// Work on the pivots and the boundary of a front.
trait Step<T>: Fn(&Factors<T>, &mut [T], &mut [T]) + Sync {}
impl<T, F: Fn(&Factors<T>, &mut [T], &mut [T]) + Sync> Step<T> for F {}

/// Distributes the parts of a subtree's slice to the children.
fn split<'a, T>(
    fronts: &[Front],
    front: &Front,
    mut slice: &'a mut [T],
    size: impl Fn(&Front) -> usize,
) -> Vec<(usize, &'a mut [T])> {
    let mut parts = Vec::with_capacity(front.children.len());
    for &child in &front.children {
        let (part, rest) = slice.split_at_mut(size(&fronts[child]));
        parts.push((child, part));
        slice = rest;
    }
    parts
}

/// Results in the order of the jobs, whichever thread does them.
fn each<J: Send, T: Send>(jobs: Vec<J>, parallel: bool, work: impl Fn(J) -> T + Sync + Send) -> Vec<T> {
    if parallel { jobs.into_par_iter().map(work).collect() } else { jobs.into_iter().map(work).collect() }
}

/// An element that some front still needs.
struct Parked {
    left: u32,
    element: Option<Arc<Element>>,
}

/// A factorisation at work.
struct Assembly<'a, F> {
    symbolic: &'a Symbolic,
    fill: F,
    parked: Vec<Mutex<Parked>>,
}

impl<F: Fn(usize, &mut Element) + Sync> Assembly<'_, F> {
    /// Factorises a subtree; returns the Schur complement on the boundary of its top.
    fn factorise<T: Real>(&self, node: usize, factors: &mut [Factors<T>]) -> Result<Vec<T>, SolveError> {
        let fronts = &self.symbolic.fronts;
        let front = &fronts[node];
        let (own, below) = factors.split_last_mut().expect("a subtree holds its top");
        let parts = split(fronts, front, below, |child| child.fronts_below());
        let parallel = front.work > PARALLEL_FACTORISATION;
        let updates = each(parts, parallel, |(child, factors)| self.factorise(child, factors));
        let b = front.boundary.len();
        own.reset();
        let mut schur = vec![T::of(0.0); b * b];
        for (&child, update) in front.children.iter().zip(updates) {
            extend(own, &mut schur, &fronts[child].into_parent, &update?);
        }
        self.assemble(front, own);
        self.eliminate(front, own, &mut schur)?;
        Ok(schur)
    }

    /// Factorises the fronts of a subtree that are not `old`.
    fn renew<T: Real>(
        &self,
        node: usize,
        factors: &mut [Factors<T>],
        kept: &mut [Vec<T>],
        old: &[bool],
    ) -> Result<(), SolveError> {
        if old[node] {
            return Ok(());
        }
        let fronts = &self.symbolic.fronts;
        let front = &fronts[node];
        let (own, below) = factors.split_last_mut().expect("a subtree holds its top");
        let (schur, kept) = kept.split_last_mut().expect("a subtree holds its top");
        let parts = split(fronts, front, below, |child| child.fronts_below());
        let parts: Vec<_> = parts.into_iter().zip(split(fronts, front, kept, |child| child.fronts_below())).collect();
        let parallel = front.work > PARALLEL_FACTORISATION;
        let updates = each(parts, parallel, |((child, factors), (_, kept))| {
            self.renew(child, factors, kept, old)?;
            Ok(&kept[kept.len() - 1])
        });
        own.reset();
        schur.fill(T::of(0.0));
        for (&child, update) in front.children.iter().zip(updates) {
            extend(own, schur, &fronts[child].into_parent, update?);
        }
        self.assemble(front, own);
        self.eliminate(front, own, schur)
    }

    fn eliminate<T: Real>(&self, front: &Front, own: &mut Factors<T>, schur: &mut [T]) -> Result<(), SolveError> {
        own.eliminate(schur).map_err(|pivot| {
            let unknown = self.symbolic.order[front.start + pivot];
            SolveError::Factorise {
                system: self.symbolic.system.clone(),
                reason: format!("the pivot of unknown {unknown} is zero to rounding or not finite"),
                hint: "a boundary condition may be missing, or a parameter may be zero that must not be".into(),
            }
        })
    }

    /// Adds the element entries in the rows and columns of the pivots.
    fn assemble<T: Real>(&self, front: &Front, factors: &mut Factors<T>) {
        let mut buffer = Element::default();
        for &e in &front.elements {
            let shared = self.fetch(e as usize, &mut buffer);
            scatter(front, factors, &self.symbolic.place, shared.as_deref().unwrap_or(&buffer));
        }
    }

    /// The element, in the buffer or shared with other fronts. Two threads may both compute it, with the same result.
    fn fetch(&self, e: usize, buffer: &mut Element) -> Option<Arc<Element>> {
        let lock = || self.parked[e].lock().expect("no thread panics while it holds an element");
        {
            let mut parked = lock();
            if let Some(element) = parked.element.clone() {
                parked.left -= 1;
                if parked.left == 0 {
                    parked.element = None;
                }
                return Some(element);
            }
        }
        (self.fill)(e, buffer);
        let mut parked = lock();
        parked.left -= 1;
        if parked.left == 0 {
            parked.element = None;
            return None;
        }
        let element = parked.element.get_or_insert_with(|| Arc::new(std::mem::take(buffer)));
        Some(Arc::clone(element))
    }
}

impl Front {
    /// Number of fronts in the subtree.
    fn fronts_below(&self) -> usize {
        self.children.last().map_or(1, |&last| last - self.first + 2)
    }
}

/// Adds a child's Schur complement; row and column `i` of it belong to row and column `into[i]` of the front.
fn extend<T: Real>(factors: &mut Factors<T>, schur: &mut [T], into: &[u32], update: &[T]) {
    if into.is_empty() {
        return;
    }
    let p = factors.permutation.len();
    let b = schur.len().isqrt();
    let inner = into.partition_point(|&row| (row as usize) < p);
    let (pivots, outer) = into.split_at(inner);
    for (&column, update) in into.iter().zip(update.chunks_exact(into.len())) {
        let column = column as usize;
        let (top, bottom) = if column < p {
            (&mut factors.lu[column * p..(column + 1) * p], &mut factors.lower[column * b..(column + 1) * b])
        } else {
            let column = column - p;
            (&mut factors.upper[column * p..(column + 1) * p], &mut schur[column * b..(column + 1) * b])
        };
        pivots.iter().zip(&update[..inner]).for_each(|(&row, v)| top[row as usize] += *v);
        outer.iter().zip(&update[inner..]).for_each(|(&row, v)| bottom[row as usize - p] += *v);
    }
}

/// Adds the entries of an element in the rows and columns of the pivots.
fn scatter<T: Real>(front: &Front, factors: &mut Factors<T>, place: &[u32], element: &Element) {
    let (p, b) = (front.pivots(), front.boundary.len());
    let row = |&unknown: &u32| front.row(place[unknown as usize] as usize);
    let columns: Vec<_> = element.columns.iter().enumerate().filter_map(|(j, u)| Some((j, row(u)?))).collect();
    let width = element.columns.len();
    for (i, unknown) in element.rows.iter().enumerate() {
        let Some(i_front) = row(unknown) else { continue };
        let values = &element.values[i * width..(i + 1) * width];
        for &(j, j_front) in &columns {
            match (i_front < p, j_front < p) {
                (true, true) => factors.lu[j_front * p + i_front] += T::of(values[j]),
                (true, false) => factors.upper[(j_front - p) * p + i_front] += T::of(values[j]),
                (false, true) => factors.lower[j_front * b + i_front - p] += T::of(values[j]),
                (false, false) => {}
            }
        }
    }
}

impl<T: Real> Factors<T> {
    /// `x ← L⁻¹ P x`, `y ← y − L21 x`.
    fn forward(&self, x: &mut [T], y: &mut [T]) {
        let old = x.to_vec();
        x.iter_mut().zip(&self.permutation).for_each(|(x, &i)| *x = old[i as usize]);
        solve_lower(&self.lu, x);
        subtract_product(&self.lower, y.len(), x, y);
    }

    /// `x ← U⁻¹ (x − U12 y)`.
    fn backward(&self, x: &mut [T], y: &mut [T]) {
        subtract_product(&self.upper, x.len(), y, x);
        solve_upper(&self.lu, x);
    }
}
