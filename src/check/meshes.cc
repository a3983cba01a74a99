// Meshes that collide: closed, of a size that is worth loading, near to their hulls.
#include <algorithm>

#include <fmt/format.h>

#include "base/quantity.h"
#include "check/model_check.h"
#include "load/mesh_facts.h"

namespace assay::findings {
namespace {

// Reading takes about a second for a million triangles, and only the hull collides.
constexpr size_t kHugeTriangles = 100'000;
constexpr std::uintmax_t kHugeBytes = 20'000'000;
// A hull with half again the mesh's volume touches where the robot has no surface.
constexpr double kConcave = 1.5;

}  // namespace

void add_meshes(const Model& model, const FileFacts& facts, std::vector<Finding>& out) {
  Finding open = {.kind = "mesh-open",
                  .title = "meshes that are not watertight",
                  .unit = "1",
                  .advice = "their hulls are used all the same; a mass or inertia that is computed from them is wrong"};
  Finding huge = {.kind = "mesh-huge",
                  .title = "huge meshes",
                  .unit = "1",
                  .advice = "most of the loading time; only their hulls collide: simplify them"};
  Finding concave = {.kind = "mesh-concave",
                     .title = "hulls that are larger than their mesh",
                     .unit = "1",
                     .advice = "contacts act where the robot has no surface: --decompose makes several hulls of each"};
  for (const MeshFacts& mesh : facts.meshes) {
    const std::string label = fmt::format("mesh '{}'", mesh.name);
    Place place = {.element = label, .line = mesh.line, .file = mesh.in};
    if (mesh.triangles > kHugeTriangles || mesh.bytes > kHugeBytes) {
      place.value = static_cast<double>(mesh.triangles);
      place.text = fmt::format("{} triangles, {} MB", mesh.triangles, (mesh.bytes + 500'000) / 1'000'000);
      huge.places.push_back(place);
    }
    if (mesh.open_edges > 0) {
      place.value = static_cast<double>(mesh.open_edges);
      place.text = fmt::format("{} of {} edges open", mesh.open_edges, mesh.triangles * 3 / 2);
      open.places.push_back(place);
      continue;
    }
    const auto hull = std::ranges::find(model.hulls, mesh.name, &Hull::name);
    if (hull == model.hulls.end() || mesh.volume <= 0) continue;
    const double ratio = enclosed_volume(hull->vertices, hull->faces) / mesh.volume;
    if (ratio < kConcave) continue;
    place.value = ratio;
    place.text = fmt::format("{:.3g} times its volume", ratio);
    concave.places.push_back(place);
  }
  for (Finding* finding : {&huge, &concave, &open}) {
    sort_by_value(*finding);
    finding->all = finding->places.size() == facts.meshes.size();
    add(std::move(*finding), out);
  }
}

}  // namespace assay::findings
