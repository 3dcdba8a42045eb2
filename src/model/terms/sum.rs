//! Sums over lists of terms.

use super::{At, Functional, Pass, Term, Weak};
use crate::form::words::{Jet, Scalar, Vector};
use crate::form::{Bilinear, Linear};
use crate::model::parameters::Parameters;

/// The terms of some lists that are on, as they enter the residual.
#[derive(Clone, Copy)]
pub struct Sum<'t, V: Jet + 'static> {
    lists: &'t [&'static [Term<V>]],
    /// Those alone whose matrix is assembled once in a sheet of density 1, or the others.
    constant: Option<bool>,
}

impl<'t, V: Jet> Sum<'t, V> {
    /// Of these lists.
    pub fn of(lists: &'t [&'static [Term<V>]]) -> Self {
        Self { lists, constant: None }
    }

    /// Without the terms whose matrix is assembled once in a sheet of density 1.
    #[must_use]
    pub fn varying(self) -> Self {
        Self { constant: Some(false), ..self }
    }

    /// Those terms alone.
    #[must_use]
    pub fn constant(self) -> Self {
        Self { constant: Some(true), ..self }
    }

    fn terms<'p>(self, parameters: &'p Parameters) -> impl Iterator<Item = &'static Term<V>> + use<'t, 'p, V> {
        let all = self.lists.iter().flat_map(|list| list.iter());
        all.filter(move |term| term.is_on(parameters))
    }

    fn has(self, functional: &Functional<V>) -> bool {
        self.constant.is_none_or(|constant| constant == functional.is_constant)
    }

    fn functionals<'p>(
        self,
        parameters: &'p Parameters,
    ) -> impl Iterator<Item = (f64, &'static Functional<V>)> + use<'t, 'p, V> {
        let functional = move |term: &'static Term<V>| match &term.weak {
            Weak::Functional(functional) if self.has(functional) => Some((term.scale(parameters), functional)),
            Weak::Functional(_) | Weak::Flow { .. } | Weak::With(_) | Weak::Frame => None,
        };
        self.terms(parameters).filter_map(functional)
    }

    /// The residual, but for the terms that are linear in the flow.
    pub fn value<'a>(self, at: &At<'a>) -> Linear<'a, V> {
        let each = self.functionals(at.parameters);
        each.fold(Linear::zero(), |sum, (scale, term)| sum + scale * (term.value)(at))
    }

    fn derivative<'a, U: Jet, W: Jet>(
        self,
        at: &At<'a>,
        of: impl Fn(&Functional<V>) -> super::Derivative<U, W>,
    ) -> Bilinear<'a, U, W> {
        let each = self.functionals(at.parameters);
        each.fold(Bilinear::zero(), |sum, (scale, term)| sum + scale * of(term)(at))
    }

    /// Along the velocity, but for the terms that are linear in it.
    pub fn by_velocity<'a>(self, at: &At<'a>) -> Bilinear<'a, Vector, V> {
        self.derivative(at, |term| term.by_velocity)
    }

    /// Along the density.
    pub fn by_density<'a>(self, at: &At<'a>) -> Bilinear<'a, Scalar, V> {
        let functionals = self.derivative(at, |term| term.by_density);
        self.terms(at.parameters).fold(functionals, |sum, term| match &term.weak {
            Weak::Flow { weight, by_density, .. } => {
                sum + term.scale(at.parameters) * weight(at.parameters.into()) * by_density(at)
            }
            Weak::Functional(_) | Weak::With(_) | Weak::Frame => sum,
        })
    }

    /// Along the polarity, but for the parts that act on both components alike.
    pub fn by_polarity<'a>(self, at: &At<'a>) -> Bilinear<'a, Vector, V> {
        self.derivative(at, |term| term.by_polarity)
    }

    /// Along the polarity: the parts that act on both components alike.
    pub fn by_components<'a>(self, at: &At<'a>) -> Bilinear<'a, Scalar, Scalar> {
        self.derivative(at, |term| term.by_components)
    }

    /// Whether derivatives along polarity or field have integrals over the faces between cells.
    pub fn is_wide(self, parameters: &Parameters) -> bool {
        self.functionals(parameters).any(|(_, term)| term.wide)
    }

    /// Along `L_h/B`.
    pub fn by_field<'a>(self, at: &At<'a>) -> Bilinear<'a, Vector, V> {
        self.derivative(at, |term| term.by_field)
    }
}

/// The linear equation of one pass of the fixed point at the last iterate: operators on the new one, and what does not
/// depend on it, on the left side.
pub struct PassForms<'a> {
    /// Acts on both components alike.
    pub components: Bilinear<'a, Scalar, Scalar>,
    pub full: Bilinear<'a, Vector, Vector>,
    pub rest: Linear<'a, Vector>,
}

impl Sum<'_, Vector> {
    /// The equation of one pass.
    pub fn pass<'a>(self, at: &At<'a>) -> PassForms<'a> {
        let nothing = PassForms { components: Bilinear::zero(), full: Bilinear::zero(), rest: Linear::zero() };
        self.terms(at.parameters).fold(nothing, |forms, term| {
            let Weak::Functional(functional) = &term.weak else { return forms };
            if !self.has(functional) {
                return forms;
            }
            let scale = term.scale(at.parameters);
            let PassForms { components, full, rest } = forms;
            match &term.pass {
                Pass::Lagged => PassForms { components, full, rest: rest + scale * (functional.value)(at) },
                Pass::Implicit { data } => PassForms {
                    components: components + scale * (functional.by_components)(at),
                    full: full + scale * (functional.by_polarity)(at),
                    rest: data.map_or_else(Linear::zero, |data| scale * data(at)) + rest,
                },
                Pass::Frozen { operator, rest: frozen } => {
                    PassForms { components: components + scale * operator(at), full, rest: rest + scale * frozen(at) }
                }
            }
        })
    }
}
