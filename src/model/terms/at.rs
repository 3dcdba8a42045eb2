//! What a weak form may depend on.

use std::sync::OnceLock;

use crate::form::upwind::Carrier;
use crate::form::{Density, FacePoint, Faces};
use crate::mesh::{Mesh, Point};
use crate::model::Conditions;
use crate::model::manufactured::Exact;
use crate::model::parameters::Parameters;
use crate::model::polarity::data_of;
use crate::space::{Field, Space, Traces};

/// The fields at one time, and what the boundary gives.
#[derive(Clone, Copy)]
pub struct At<'a> {
    /// The numbers of the model.
    pub parameters: &'a Parameters,
    /// Polarity.
    pub p: &'a Field,
    /// ρ as a weight.
    pub rho: Density<'a>,
    /// What the boundary gives.
    pub given: &'a Given<'a>,
    flow: Option<(&'a Space, Carrier<'a>)>,
    density: Option<&'a Space>,
    l: Option<&'a Field>,
    traces: Option<&'a Traces>,
}

/// What the boundary gives at one time.
#[derive(Debug)]
pub struct Given<'m> {
    mesh: &'m Mesh,
    conditions: &'m [Conditions],
    t: f64,
    /// Faces with a prescribed polarity.
    pub dirichlet: Faces,
    /// Faces through which mass may pass.
    pub open: Faces,
    /// Where the energy-consistent force needs boundary terms: faces where `w·n` is free, and those of them or of slip
    /// where the polarity has a slope.
    pub natural: [Faces; 2],
    /// Faces where `∂_np` is that of exact fields.
    pub sloped: Option<(Faces, &'m Exact)>,
    /// The exact fields at this time, once somebody asks.
    exact: OnceLock<Exact>,
}

impl<'a> At<'a> {
    /// Without a flow, in a sheet of density 1: enough for the derivative of the free energy.
    pub fn new(parameters: &'a Parameters, p: &'a Field, given: &'a Given<'a>) -> Self {
        Self { parameters, p, rho: Density::One, given, flow: None, density: None, l: None, traces: None }
    }

    /// With a density.
    #[must_use]
    pub fn with_density(self, rho: &'a Field) -> Self {
        Self { rho: Density::Of(rho), density: Some(&rho.space), ..self }
    }

    /// With the velocity's space, and the flow that carries.
    #[must_use]
    pub fn with_flow(self, velocity: &'a Space, carrier: Carrier<'a>) -> Self {
        Self { flow: Some((velocity, carrier)), ..self }
    }

    /// With `L_h/B`, where the sheet has elasticity.
    #[must_use]
    pub fn with_field(self, l: Option<&'a Field>) -> Self {
        Self { l, ..self }
    }

    /// With the values of the polarity on the faces, where it is in hybrid form.
    #[must_use]
    pub fn with_traces(self, traces: Option<&'a Traces>) -> Self {
        Self { traces, ..self }
    }

    /// With other parameters.
    #[must_use]
    pub fn with_parameters(self, parameters: &'a Parameters) -> Self {
        Self { parameters, ..self }
    }

    /// The velocity's space.
    ///
    /// # Panics
    /// Without a flow, on which the derivative of the free energy does not depend.
    pub fn velocity(&self) -> &'a Space {
        self.flow.expect("the terms of a flow have one").0
    }

    /// The flow that carries, and the flow that picks the upwind sides.
    ///
    /// # Panics
    /// As [`At::velocity`].
    pub fn carrier(&self) -> Carrier<'a> {
        Carrier { density: self.rho, ..self.flow.expect("the terms of a flow have one").1 }
    }

    /// v
    ///
    /// # Panics
    /// As [`At::velocity`].
    pub fn v(&self) -> &'a Field {
        self.carrier().flow
    }

    /// ρ of a sheet that has one, and its space.
    ///
    /// # Panics
    /// In the incompressible sheet, whose terms do not ask.
    pub fn density(&self) -> (&'a Field, &'a Space) {
        match (self.rho, self.density) {
            (Density::Of(rho), Some(space)) => (rho, space),
            (Density::One | Density::Of(_), _) => panic!("the incompressible sheet has no density"),
        }
    }

    /// The values of the polarity on the faces, where it is in hybrid form.
    pub fn traces(&self) -> Option<&'a Traces> {
        self.traces
    }

    /// `L_h/B`
    ///
    /// # Panics
    /// Without elasticity, where the terms that ask are off.
    pub fn molecular(&self) -> &'a Field {
        self.l.expect("a sheet with elasticity has a molecular field")
    }
}

impl<'m> Given<'m> {
    /// At time `t`, with one of `conditions` per tag of the mesh, and exact fields on the faces where they give `∂_np`.
    pub fn new(
        mesh: &'m Mesh,
        conditions: &'m [Conditions],
        dirichlet: Faces,
        sloped: Option<(Faces, &'m Exact)>,
        t: f64,
    ) -> Self {
        let (open, natural) = (Faces::NONE, [Faces::NONE; 2]);
        Self { mesh, conditions, t, dirichlet, open, natural, sloped, exact: OnceLock::new() }
    }

    /// With the faces through which mass may pass.
    #[must_use]
    pub fn with_open(self, open: Faces) -> Self {
        Self { open, ..self }
    }

    /// With the faces where the energy-consistent force needs boundary terms.
    #[must_use]
    pub fn with_natural(self, natural: [Faces; 2]) -> Self {
        Self { natural, ..self }
    }

    fn conditions(&self, s: &FacePoint) -> &'m Conditions {
        &self.conditions[self.mesh.faces[s.face].tag.expect("a face of the boundary")]
    }

    /// `p_D` on a Dirichlet face.
    ///
    /// # Panics
    /// On another face.
    pub fn polarity(&self, s: &FacePoint) -> Point {
        let value = data_of(self.conditions(s)).expect("Dirichlet faces carry data");
        Point::new(value[0].eval(s.minus.x, self.t), value[1].eval(s.minus.x, self.t))
    }

    /// `ρ_in` on a face where tissue may enter.
    pub fn inflow(&self, s: &FacePoint) -> f64 {
        self.conditions(s).inflow(s.minus.x, self.t)
    }

    /// `∂_np` of the exact fields.
    ///
    /// # Panics
    /// Without exact fields.
    pub fn slope(&self, s: &FacePoint) -> Point {
        let exact = self.exact.get_or_init(|| self.sloped.expect("exact fields give the slope").1.at_time(self.t));
        exact.polarity_slope(s.minus.x, self.t, s.n)
    }
}
