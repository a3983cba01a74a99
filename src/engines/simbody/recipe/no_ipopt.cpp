// Stands in for Simbody's file of this name, which uses Ipopt. Simbody chooses that optimiser where there are constraints;
// assay optimises nothing.
#include "InteriorPointOptimizer.h"

namespace SimTK {

InteriorPointOptimizer::InteriorPointOptimizer(const OptimizerSystem& sys) : OptimizerRep(sys) {
  SimTK_THROW1(SimTK::Exception::Cant, "built without Ipopt");
}
Optimizer::OptimizerRep* InteriorPointOptimizer::clone() const { return new InteriorPointOptimizer(*this); }
Real InteriorPointOptimizer::optimize(Vector& /*results*/) { return NaN; }

}  // namespace SimTK
