//! Words of papers and of other programs, and what they are here.

/// Names that must all be among those that exist where the row is to apply; words, in lower case without anything but
/// letters and digits; the name that exists, or what is to be said.
pub(super) type Row = (&'static str, &'static str, &'static str);

const NO_SLIP: &str = "it is { dirichlet = [0, 0] }";
const VISCOUS: &str = "there is no such key: everything is measured in units of the viscosity, which is 1";
const NO_INERTIA: &str = "there is no such key: the flow has no inertia";
const FRICTION_OR_ALIGNMENT: &str = "friction with the substrate is `friction`, alignment with the flow `alignment`";
const FRICTION_OR_EXPONENT: &str = "friction is `friction`, the exponent of the pressure `density.exponent`";
const PERIODIC: &str = "there are no periodic boundaries; the shapes \"racetrack\" and \"annulus\" are closed";
const WALL_FRICTION: &str = "a wall with friction is { friction = b }, of slip length 1/b";
const FIRST_STEP: &str = "`step` is the first step and the largest one";
const BDF: &str = "there are the BDF of order 1 to 6; \"bdf2\" is usual";

/// The first row that fits counts.
pub(super) const WORDS: &[Row] = &[
    // conditions of the velocity
    (
        "no-tangential",
        "noslip nonslip notslip noslipwall wall walls stick sticking sticky nostick rigid rigidwall solid \
         zero zerovelocity fixed fixedwall adherent hold held nslip",
        NO_SLIP,
    ),
    (
        "no-tangential",
        "freeslip fullslip perfectslip slipwall symmetry symmetric mirror impermeable nopenetration \
         nonpenetration frictionless nonormal notraversal",
        "slip",
    ),
    (
        "no-tangential",
        "outflow outlet open donothing nothing free stressfree nostress zerostress tractionfree notraction \
         freesurface natural neumann zerogradient noforce",
        "it is \"traction\", which is zero where no values are given",
    ),
    ("no-tangential", "stress force load surfaceforce", "traction"),
    (
        "no-tangential",
        "inflow inlet velocity profile prescribed value fixedvalue given imposed uniform parabolic poiseuille \
         lid",
        "it is { dirichlet = [\"v_1\", \"v_2\"] }",
    ),
    (
        "no-tangential",
        "pressure pressureinlet pressureoutlet pressuredrop fixedpressure",
        "a pressure P on the boundary is { traction = […] } with the values −P n",
    ),
    ("no-tangential", "notangent normalonly normalflow notangentialvelocity", "no-tangential"),
    ("no-tangential", "periodic cyclic wrap", PERIODIC),
    ("no-tangential", "navier navierslip partialslip robin wallfriction sliplength mixed", WALL_FRICTION),
    // conditions of the polarity
    (
        "neumann dirichlet",
        "noflux zeroflux nofluxes zerogradient nogradient natural free freeanchoring noanchoring homogeneous \
         insulated open donothing outflow",
        "neumann",
    ),
    (
        "neumann dirichlet",
        "anchoring stronganchoring strong fixed prescribed value given imposed inlet inflow homeotropic \
         planar normal tangential parallel perpendicular aligned",
        "it is { dirichlet = [\"p_1\", \"p_2\"] }",
    ),
    (
        "neumann dirichlet",
        "robin weakanchoring mixed",
        "there is no weak anchoring: \"neumann\" is free, { dirichlet = […] } prescribes the polarity",
    ),
    (
        "neumann dirichlet",
        "slip noslip traction notangential wall walls",
        "that is a condition of the velocity; the polarity has \"neumann\" or { dirichlet = […] }",
    ),
    ("neumann dirichlet", "periodic cyclic", PERIODIC),
    // [boundary.TAG]
    ("velocity polarity", "v u vel flow", "velocity"),
    ("velocity polarity", "p q director orientation", "polarity"),
    (
        "velocity polarity",
        "pressure stress traction force",
        "the stress is a condition of the velocity: velocity = { traction = [s_1, s_2] }",
    ),
    ("velocity polarity", "rho concentration rhoin", "density"),
    ("velocity polarity", "type kind condition bc", "give `velocity` and `polarity`, each with a condition"),
    // [model]
    ("coherence", "kappa coherencelength correlationlength ell lengthscale frank frankconstant", "coherence"),
    ("coherence", "sa activestress activity zeta alpha contractility activestrength zetadmu sigmaa", "active_stress"),
    ("active_stress_iso", "saprime saiso isotropicactivestress sb", "active_stress_iso"),
    ("coherence", "ta tractionforce selfpropulsion propulsion motility activeforce f0 v0", "traction"),
    ("coherence", "pe pecletnumber relaxation relaxationtime rotationalviscosity gamma1", "peclet"),
    ("coherence", "b elastic elasticmodulus polarelasticity", "elasticity"),
    ("coherence", "a slip slipparameter flowalignment alignmentparameter tumbling lambda chi", "alignment"),
    ("coherence", "xi", FRICTION_OR_ALIGNMENT),
    ("coherence", "gamma", FRICTION_OR_EXPONENT),
    ("coherence", "nu nu1", "the viscosity is 1 here, and alignment with the flow is `alignment`"),
    ("coherence", "we wi weissenberg weissenbergnumber deborah", "it is `strain.weissenberg`"),
    ("coherence", "c0 bulkmodulus compressibility", "it is `density.penalty`"),
    ("coherence", "rhomin rhoc rhocrit rhocritical criticaldensity", "it is `density.critical`"),
    (
        "coherence",
        "rho rho0 meandensity",
        "the density is measured in that of the reference sheet, which is 1; a compressible sheet starts \
         from `initial.density`",
    ),
    ("friction kind", "cf drag substratefriction frictioncoefficient", "friction"),
    ("friction kind", "viscosity eta mu shearviscosity bulkviscosity", VISCOUS),
    ("friction kind", "re reynolds reynoldsnumber inertia mass", NO_INERTIA),
    ("friction kind", "rho density rho0", "there is no such key: a flow without inertia has no density"),
    ("friction kind", "equations equation type name model physics", "kind"),
    ("dynamics gravity", "friction damping gamma", "drag"),
    ("dynamics gravity", "g force", "gravity"),
    ("dynamics gravity", "inertia inertial overdamped", "dynamics"),
    ("exponent critical", "gamma power n", "exponent"),
    ("exponent critical", "c c0 modulus stiffness bulkmodulus kappa", "penalty"),
    ("exponent critical", "rhomin min minimum threshold rhoc", "critical"),
    (
        "inelastic gluey",
        "elastic bounce bouncing restitution",
        "bodies do not bounce: \"inelastic\" contacts end their approach",
    ),
    ("inelastic gluey", "sticky adhesive adhesion lubrication lubricated viscous", "gluey"),
    ("inelastic gluey", "hard rigid plastic", "inelastic"),
    ("inelastic gluey", "coulomb friction frictional", "there is no dry friction between bodies"),
    ("incompressible compressible", "navierstokes euler", "there is no inertia; kind = \"stokes\" is a Stokes flow"),
    ("incompressible compressible", "tissue active activegel polar toner tonertu", "incompressible"),
    ("incompressible compressible", "creeping creepingflow fluid", "stokes"),
    ("incompressible compressible", "bodies discs granular dem solid", "particles"),
    // [time]
    ("step end", "dt deltat timestep stepsize h tau ddt", "step"),
    ("step end", "dtmax stepmax maxstep maximumstep maxdt dt0 step0", FIRST_STEP),
    ("step end", "tmax tend tfinal finaltime finish duration until endtime t tstop stoptime total", "end"),
    ("step end", "tstart t0 starttime tmin", "there is no such key: runs start at t = 0"),
    ("step end", "cfl courant courantnumber", "there is no such key: the step is given, as `step`"),
    (
        "max_steps end",
        "nmax nsteps numsteps maxiter maxiterations steps maximumsteps number count stepsmax",
        "max_steps",
    ),
    ("max_steps end", "minsteps", "there is no such key: a run ends where `end`, `max_steps` or `stop` says"),
    ("step_min", "dtmin mindt minimumstep minstep", "step_min"),
    ("scheme end", "integrator method solver timescheme stepper order bdf", "scheme"),
    ("scheme end", "tol tolerance rtol atol", "it is `coupling.tolerance`"),
    ("bdf1", "euler impliciteuler backwardeuler be", "bdf1"),
    ("bdf1", "bdf gear", "bdf2"),
    ("bdf1", "cranknicolson cn rk4 rk2 rungekutta explicit expliciteuler forwardeuler trapezoidal imex dirk", BDF),
    ("residual energy_rate", "tol tolerance stationary steady", "residual"),
    ("residual energy_rate", "energy dfdt", "energy_rate"),
    ("weissenberg", "we wi lambda deborah de relaxation relaxationtime", "weissenberg"),
    // [mesh]
    ("shape file", "type geometry domain generator kind name", "shape"),
    ("shape file", "filename path msh gmsh meshfile", "file"),
    ("shape h_disc", "nx ny cells ncells resolution numcells divisions", "n"),
    ("shape h_disc", "size hmax lc dx edge cellsize meshsize maxsize elementsize", "h"),
    ("shape h_disc", "hmin hhole hcircle hobstacle", "h_disc"),
    ("shape h_disc", "r rad", "radius"),
    ("shape h_disc", "diameter d", "`radius` is half of it"),
    ("shape h_disc", "l lx extent xrange", "length"),
    ("shape h_disc", "w ly height", "width"),
    ("shape h_disc", "rin innerr rinner", "inner_radius"),
    ("shape h_disc", "order degree curvature geometryorder", "curved"),
    ("shape h_disc", "growth ratio gradation", "grading"),
    ("strip-with-disc", "channel rectangle box pipe duct", "strip"),
    ("strip-with-disc", "unitsquare cavity", "square"),
    ("strip-with-disc", "circle disk ball", "disc"),
    ("strip-with-disc", "ring shell", "annulus"),
    (
        "strip-with-disc",
        "obstacle cylinder channelwithdisc channelwithcylinder stripwithcircle stripwithhole",
        "strip-with-disc",
    ),
    ("strip-with-disc", "stadium track loop", "racetrack"),
    // [space], [coupling], [steady]
    ("k penalty", "order degree p element polynomial", "k"),
    ("walls penalty", "slip wall slipwalls", "walls"),
    ("walls penalty", "epsilon eps", "penalty"),
    ("rotated penalty", "strong rotation rotate", "rotated"),
    ("rotated penalty", "nitsche weak penalised penalized", "penalty"),
    ("tolerance max_iterations", "method type solver scheme", "kind"),
    ("tolerance max_iterations", "tol eps delta rtol atol epsilon", "tolerance"),
    ("tolerance max_iterations", "maxiter itmax niter maxits iterations kmax", "max_iterations"),
    (
        "tolerance max_iterations",
        "damping relaxation omega underrelaxation",
        "there is no such key: steps are not damped",
    ),
    ("fixed-point newton", "picard segregated staggered iterative iteration", "fixed-point"),
    ("fixed-point newton", "newtonraphson monolithic quasinewton", "newton"),
    ("residual eigenvalues", "tol tolerance eps", "residual"),
    ("residual eigenvalues", "modes neig nev eigs spectrum", "eigenvalues"),
    ("stable any", "unstable all", "\"stable\" leaves an unstable state, \"any\" takes the first that is found"),
    // [initial], [exact], [source]
    (
        "aligned-around-disc",
        "uniform constant aligned ordered",
        "uniform polarity is [1, 0]; \"aligned-around-disc\" lays it around a disc",
    ),
    ("aligned-around-disc", "noise disordered isotropic perturbation", "it is { random = { seed = 1 } }"),
    ("aligned-around-disc", "zero none rest", "it is [0, 0]"),
    ("aligned-around-disc", "restart checkpoint continue load", "it is { file = \"…\" }"),
    ("aligned-around-disc", "vortex rotating azimuthal", "circulating"),
    ("force polarity", "f fv bodyforce momentum", "force"),
    ("force polarity", "v u velocity", "the source of the velocity's equation is `force`"),
    ("velocity pressure boundary", "v u", "velocity"),
    ("velocity pressure boundary", "p", "`polarity` is p, `pressure` is Π"),
    ("velocity pressure boundary", "rho", "density"),
    // [[output]]
    ("fields every", "vtk vtu paraview field", "fields"),
    ("fields every", "interval frequency dt period", "every"),
    ("fields every", "probes lines sections profiles cut", "cuts"),
    ("fields every", "figures plots pictures images map", "maps"),
    ("fields every", "restart save checkpoints", "checkpoint"),
    ("time steps", "dt t interval", "time"),
    ("time steps", "n iterations step count", "steps"),
    ("molecular_field", "v u flow", "velocity"),
    ("molecular_field", "p director orientation", "polarity"),
    ("molecular_field", "rho concentration", "density"),
    ("molecular_field", "psi streamlines stream", "stream_function"),
    ("molecular_field", "h l molecular", "molecular_field"),
    ("molecular_field", "omega curl vort rotation rot", "vorticity"),
    ("molecular_field", "div expansion dilation dilatation growth", "divergence"),
    ("overshoot free_energy", "energy f", "free_energy"),
    ("overshoot free_energy", "budget power dissipation", "energy_budget"),
    ("overshoot free_energy", "symmetry", "asymmetry"),
    ("overshoot free_energy", "charge charges topologicaldefects", "defects"),
    ("overshoot free_energy", "mindensity rhomin", "density_min"),
    ("overshoot free_energy", "force drag lift", "it is \"holding\" of a body that is held, \"wall_force\" of walls"),
    ("speed velocity_1", "v velocity u vx", "`speed` is |v|, `velocity_1` and `velocity_2` are its components"),
    ("speed velocity_1", "p order", "polarity"),
    ("speed velocity_1", "rho", "density"),
    // bodies
    ("disc capsule", "circle sphere disk round", "disc"),
    ("disc capsule", "rod spherocylinder stadium pill", "capsule"),
    ("disc capsule", "hexagon pentagon octagon ngon equilateral", "regular-polygon"),
    ("disc capsule", "box rectangle square triangle", "polygon"),
    ("disc capsule", "oval", "ellipse"),
    ("shape position", "x centre center location pos at", "position"),
    ("shape position", "theta rotation orientation phi", "angle"),
    ("shape position", "omega angularvelocity rotationrate", "spin"),
    ("shape position", "mass m rho", "`density` is the mass per area"),
    ("shape position", "radius r", "it is part of the shape: shape = { disc = { radius = 0.1 } }"),
    ("shape position", "v", "velocity"),
    ("free pinned", "static immobile clamped still frozen", "fixed"),
    ("free pinned", "dynamic mobile moving passive", "free"),
    ("free pinned", "prescribed driven moved", "it is { held = { velocity = […] } } or { path = { position = […] } }"),
    ("free pinned", "hinge hinged pivot pin", "pinned"),
    ("shape position", "type geometry", "shape"),
    // the file
    ("model boundary", "boundaries bc bcs boundaryconditions", "boundary"),
    ("mesh model", "domain geometry grid", "mesh"),
    ("model output", "parameters physics equations", "model"),
    ("initial boundary", "ic ics init initialconditions start initialcondition", "initial"),
    ("source boundary", "forces rhs forcing", "source"),
    ("coupling boundary", "solver nonlinear newton", "coupling"),
    ("body bodies", "obstacle obstacles particle particles disc discs", "body"),
    ("strain boundary", "viscoelastic viscoelasticity", "strain"),
    ("time model", "scheme integrator stepping", "time"),
    // studies
    ("scene vary", "sweep parameters grid axes", "vary"),
    ("scene case", "run runs cases", "case"),
    // formulas
    ("pi tau", "time", "t"),
    ("pi tau", "x1 xx", "x"),
    ("pi tau", "x2 yy", "y"),
    ("pi tau", "z x3", "the plane has x and y alone"),
    ("pi tau", "r radius", "the distance from the origin is hypot(x, y)"),
    ("pi tau", "theta phi", "the angle about the origin is atan2(y, x)"),
    ("heaviside", "arctan", "atan"),
    ("heaviside", "arctan2", "atan2"),
    ("heaviside", "arcsin", "asin"),
    ("heaviside", "arccos", "acos"),
    ("heaviside", "step theta stepfunction", "heaviside"),
    ("heaviside", "pow power", "a power is x^n"),
    ("heaviside", "where piecewise ifelse iif", "if"),
    ("heaviside", "norm length", "hypot"),
    ("heaviside", "sgn signum", "sign"),
    ("heaviside", "fabs", "abs"),
    (
        "heaviside",
        "rand random noise randn",
        "formulas have no noise; initial.polarity = { random = { seed = 1 } } has",
    ),
    // [initial], whose names other lists have, too
    ("polarity", "velocity v u", "the velocity has no start of its own: it follows from the polarity"),
];
