//! The incompressible tissue: velocity and pressure that follow the polarity, and a polarity that the flow carries.

use std::sync::Arc;

use super::boundary::{Conditions, VelocityCondition};
use super::expression::{Expression, ExpressionError};
use super::momentum::{Momentum, MomentumError, SlipTreatment, tagged};
use super::parameters::Parameters;
use super::polarity::{FORMULA_DEGREE, Polarity, data_of};
use crate::form::{CellPoint, FacePoint, Faces, Integrator, Linear, elastic, mass, polarity, stokes};
use crate::mesh::{Mesh, Point};
use crate::solve::{SolveError, dot};
use crate::space::{Continuity, Field, Space};

/// Polynomial degrees of the three fields.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Degrees {
    pub velocity: usize,
    pub pressure: usize,
    pub polarity: usize,
}

/// Sources of a manufactured solution; `None` where there is none.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Sources {
    /// `f_v`
    pub force: Option<[Expression; 2]>,
    /// `f_p`
    pub polarity: Option<[Expression; 2]>,
}

/// All that defines a problem besides its mesh.
#[derive(Debug, Clone)]
pub struct Description {
    pub parameters: Parameters,
    pub degrees: Degrees,
    /// One per mesh tag.
    pub conditions: Vec<Conditions>,
    pub sources: Sources,
    pub slip: SlipTreatment,
}

/// Velocity, pressure and polarity at one time.
#[derive(Debug, Clone)]
pub struct State {
    pub v: Field,
    pub pi: Field,
    pub p: Field,
}

/// Residuals of the stationary equations, each `(rᵀMr/|Ω|)^½`   [9.8], [9.9], [9.10]
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Residuals {
    pub velocity: f64,
    pub pressure: f64,
    pub polarity: f64,
}

impl Residuals {
    /// Root of the sum of squares.
    pub fn total(&self) -> f64 {
        self.velocity.hypot(self.pressure).hypot(self.polarity)
    }
}

/// The semi-discrete incompressible system   [7.11]
#[derive(Debug)]
pub struct Incompressible {
    pub parameters: Parameters,
    pub conditions: Vec<Conditions>,
    pub sources: Sources,
    pub loops: Integrator,
    pub momentum: Momentum,
    pub polarity: Polarity,
    /// `|Ω|`
    pub area: f64,
}

impl Incompressible {
    /// Builds spaces, assembles what is constant and factorises the Stokes matrix.
    ///
    /// # Errors
    /// As [`Momentum::new`] and [`Polarity::new`]; boundary formulas that are not finite at the start.
    pub fn new(mesh: &Arc<Mesh>, description: &Description) -> Result<Self, MomentumError> {
        let Description { parameters, degrees, conditions, sources, slip } = description;
        let velocity = Arc::new(Space::new(mesh, Continuity::Continuous, degrees.velocity, 2));
        let pressure = Arc::new(Space::new(mesh, Continuity::Continuous, degrees.pressure, 1));
        let space = Arc::new(Space::new(mesh, Continuity::Discontinuous, degrees.polarity, 2));
        let loops = Integrator::new(mesh);
        let momentum = Momentum::new(&loops, &velocity, &pressure, conditions, parameters.friction, *slip)?;
        let polarity = Polarity::new(&loops, &space, conditions, parameters)?;
        Ok(Self {
            parameters: *parameters,
            conditions: conditions.clone(),
            sources: sources.clone(),
            loops,
            momentum,
            polarity,
            area: mesh.area(),
        })
    }

    /// The state of rest.
    pub fn zero(&self) -> State {
        State {
            v: Field::zero(&self.momentum.velocity),
            pi: Field::zero(&self.momentum.pressure),
            p: Field::zero(&self.polarity.space),
        }
    }

    /// `F(w) = T_a(p|w) − ω(p,L_h,w) − a δ(p,L_h,w) + κ²B c_h(p,p,w) + S_a δ(p,p,w) + (f_v|w) + ∫_Γ g·w`   [7.11a]
    ///
    /// Terms whose parameter is zero are not assembled; without elasticity no `L_h` is computed.
    pub fn force(&self, p: &Field, t: f64) -> Vec<f64> {
        let (m, velocity) = (&self.parameters, &*self.momentum.velocity);
        let molecular = (m.elasticity != 0.0).then(|| self.polarity.molecular_over_b(&self.loops, p, t));
        let mut form = Linear::zero();
        if m.traction != 0.0 {
            form = form + m.traction * mass::load(velocity, p.space.degree, |x| p.vector(&x.site));
        }
        if let Some(l) = &molecular {
            let b = m.elasticity;
            form = form - b * polarity::rotation_force(velocity, p, l);
            if m.slip != 0.0 {
                form = form - b * m.slip * polarity::stretching_force(velocity, p, l);
            }
            form = form + m.coherence.powi(2) * b * elastic::ericksen(velocity, p);
        }
        if m.active_stress != 0.0 {
            form = form + m.active_stress * polarity::stretching_force(velocity, p, p);
        }
        form = form + self.outer_force(t);
        self.loops.vector(&form, velocity)
    }

    /// `(f_v|w) + ∫_Γ g·w` with the traction `g` of the `traction` tags.
    fn outer_force(&self, t: f64) -> Linear<'_, crate::form::words::Vector> {
        let velocity = &*self.momentum.velocity;
        let mut form = Linear::zero();
        if let Some([f, g]) = &self.sources.force {
            let value = move |x: &CellPoint| Point::new(f.eval(x.site.x, t), g.eval(x.site.x, t));
            form = form + mass::load(velocity, FORMULA_DEGREE, value);
        }
        let pulled = tagged(&self.conditions, |c| match c {
            VelocityCondition::Traction(g) => !g.iter().all(Expression::is_zero),
            VelocityCondition::Dirichlet(_) | VelocityCondition::Slip | VelocityCondition::NoTangential => false,
        });
        if pulled != Faces::NONE {
            let value = move |s: &FacePoint| self.traction_at(s, t);
            form = form + stokes::traction(velocity, pulled, FORMULA_DEGREE, value);
        }
        form
    }

    fn traction_at(&self, s: &FacePoint, t: f64) -> Point {
        let tag = self.loops.mesh.faces[s.face].tag.expect("traction faces are on the boundary");
        match &self.conditions[tag].velocity {
            VelocityCondition::Traction(g) => Point::new(g[0].eval(s.minus.x, t), g[1].eval(s.minus.x, t)),
            VelocityCondition::Dirichlet(_) | VelocityCondition::Slip | VelocityCondition::NoTangential => {
                Point::zeros()
            }
        }
    }

    /// Evaluates every source and boundary formula wherever the forms do.
    ///
    /// # Errors
    /// The first one that is not finite, with its place and time.
    pub fn check_formulas(&self, t: f64) -> Result<(), ExpressionError> {
        let mut first = Ok(());
        let mut visit = |pair: &[Expression; 2], x: Point| {
            if first.is_ok() {
                first = pair.iter().try_for_each(|f| f.try_eval(x, t).map(|_| ()));
            }
        };
        for source in self.sources.force.iter().chain(&self.sources.polarity) {
            for cell in 0..self.loops.mesh.cells.len() {
                let degree = FORMULA_DEGREE + self.momentum.velocity.degree.max(self.polarity.space.degree);
                self.loops.each_cell_point(cell, degree, &mut |x| visit(source, x.site.x));
            }
        }
        for (index, face) in self.loops.mesh.faces.iter().enumerate() {
            let Some(tag) = face.tag else { continue };
            let velocity = match &self.conditions[tag].velocity {
                VelocityCondition::Traction(pair) | VelocityCondition::Dirichlet(pair) => Some(pair),
                VelocityCondition::Slip | VelocityCondition::NoTangential => None,
            };
            for pair in velocity.into_iter().chain(data_of(&self.conditions[tag])) {
                self.loops.each_face_point(index, FORMULA_DEGREE, &mut |s| visit(pair, s.minus.x));
            }
        }
        first
    }

    /// Velocity and pressure of the polarity `p` at time `t`   [8.34]
    ///
    /// # Errors
    /// As [`Momentum::solve`].
    pub fn flow(&self, p: &Field, t: f64) -> Result<(Field, Field), MomentumError> {
        self.flow_of(&self.force(p, t), t)
    }

    /// Velocity and pressure under a given force   [8.34]
    ///
    /// # Errors
    /// As [`Momentum::solve`].
    pub fn flow_of(&self, force: &[f64], t: f64) -> Result<(Field, Field), MomentumError> {
        let (v, pi) = self.momentum.solve(force, &self.prescribed(t)?)?;
        Ok((Field::new(&self.momentum.velocity, v), Field::new(&self.momentum.pressure, pi)))
    }

    fn prescribed(&self, t: f64) -> Result<Vec<f64>, ExpressionError> {
        self.momentum.frames.prescribed(&self.conditions, t)
    }

    /// Residuals of the stationary equations at `state`   [9.8], [9.9], [9.10]
    ///
    /// # Errors
    /// As [`Momentum::residual_norms`].
    pub fn residuals(&self, state: &State, t: f64) -> Result<Residuals, SolveError> {
        let root = self.area.sqrt();
        let force = self.force(&state.p, t);
        let [velocity, pressure] = self.momentum.residual_norms(&force, &state.v.values, &state.pi.values)?;
        let r = self.polarity_residual(state, t);
        let polarity = dot(&r, &self.polarity.mass_solve(&r)).max(0.0).sqrt();
        Ok(Residuals { velocity: velocity / root, pressure: pressure / root, polarity: polarity / root })
    }

    /// `Pe a_upw(p,q;v) − Pe [ω + a δ](p,q,v) + (1/B)(L_h|q) − Pe ∫_ΓDp (v·n)⊖ p_D·q − (f_p|q)` as a functional   [7.11c]
    pub fn polarity_residual(&self, state: &State, t: f64) -> Vec<f64> {
        let mut operator = self.polarity.empty_operator();
        self.polarity.operator(&self.loops, 0.0, &state.v, &state.p, &mut operator);
        let mut r = vec![0.0; state.p.values.len()];
        operator.times(&state.p.values, &mut r);
        let inputs = self.polarity_inputs(t);
        let inflow = self.polarity.inflow(&self.loops, &state.v, t);
        let well = self.polarity.mass_times(&state.p.values);
        for (((r, input), inflow), p) in r.iter_mut().zip(inputs).zip(inflow).zip(well) {
            *r -= input + inflow + p;
        }
        r
    }

    /// `κ² l_swip(q) + (f_p|q)` at time `t`   [7.11c]
    pub fn polarity_inputs(&self, t: f64) -> Vec<f64> {
        self.polarity.inputs(&self.loops, self.sources.polarity.as_ref(), t)
    }

    /// `F_h(p)` [7.2]: the free energy whose derivative is `L_h`; zero without elasticity.
    pub fn free_energy(&self, p: &Field, t: f64) -> f64 {
        let m = &self.parameters;
        if m.elasticity == 0.0 {
            return 0.0;
        }
        let data = |s: &FacePoint| self.polarity.data(s, t);
        m.elasticity * elastic::energy_over_b(&self.loops, p, m.coherence, self.polarity.dirichlet, data)
    }
}
