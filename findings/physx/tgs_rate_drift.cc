// PhysX 5.1.3, PxSolverType::eTGS: what turns freely gains or loses speed with every solver iteration, whatever the
// step.
