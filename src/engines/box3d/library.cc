#include "library.h"

#include "base/errors.h"

namespace assay::box3d {
namespace {

// Box3D writes its remarks to standard output, which belongs to the program.
void drop_remark(const char* /*message*/) {}

}  // namespace

World::World(const b3WorldDef& definition) : id_{} {
  b3SetLogFcn(drop_remark);
  id_ = b3CreateWorld(&definition);
  if (B3_IS_NULL(id_)) throw EngineError("Box3D has no room for another world in this process");
}

World::~World() { b3DestroyWorld(id_); }

}  // namespace assay::box3d
