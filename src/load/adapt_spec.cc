#include "load/adapt_spec.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <set>

#include <fmt/format.h>

#include "base/text.h"
#include "load/spec_text.h"

namespace assay {
namespace {

namespace fs = std::filesystem;

template <typename As, typename Work>
void for_each(mjSpec* spec, mjtObj type, As as, Work work) {
  std::vector<mjsElement*> elements;  // before any is deleted
  // NOLINTNEXTLINE(misc-const-correctness): `work` changes them
  for (mjsElement* e = mjs_firstElement(spec, type); e != nullptr; e = mjs_nextElement(spec, e)) elements.push_back(e);
  std::ranges::for_each(elements, work, as);
}

std::string name_of(mjsElement* element) { return spec_text(mjs_getName(element)); }

std::string mesh_name(const mjsMesh* mesh) {
  const std::string own = name_of(mesh->element);
  return own.empty() ? fs::path(spec_text(mesh->file)).stem().string() : own;
}

// The meshes that a geom needs which can collide or adds to an inertia.
std::set<std::string> physical_meshes(mjSpec* spec) {
  std::set<std::string> paired;
  for_each(spec, mjOBJ_PAIR, mjs_asPair, [&](mjsPair* pair) {
    paired.insert(spec_text(pair->geomname1));
    paired.insert(spec_text(pair->geomname2));
  });
  std::set<std::string> needed;
  for_each(spec, mjOBJ_GEOM, mjs_asGeom, [&](mjsGeom* geom) {
    const std::string mesh = spec_text(geom->meshname);
    if (mesh.empty()) return;
    const mjsBody* body = mjs_getParent(geom->element);
    const bool from_geoms = origin_of(spec, geom->element)->compiler.inertiafromgeom == mjINERTIAFROMGEOM_TRUE;
    const bool weighs = (from_geoms || !body->explicitinertial) && geom->mass != 0 && geom->density != 0 &&
                        name_of(body->element) != "world";
    const bool collides = geom->contype != 0 || geom->conaffinity != 0 || paired.contains(name_of(geom->element));
    if (weighs || collides) needed.insert(mesh);
  });
  return needed;
}

// Makes a mesh a tetrahedron, in place of one that takes the compiler long.
void make_small(mjsMesh* mesh) {
  constexpr std::array<float, 12> kCorners = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  constexpr std::array<int, 12> kFaces = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
  mjs_setName(mesh->element, mesh_name(mesh).c_str());  // a name that comes from the file
  mjs_setString(mesh->file, "");
  mjs_setString(mesh->content_type, "");
  mjs_setFloat(mesh->uservert, kCorners.data(), static_cast<int>(kCorners.size()));
  mjs_setInt(mesh->userface, kFaces.data(), static_cast<int>(kFaces.size()));
  mesh->inertia = mjMESH_INERTIA_CONVEX;
}

// With the contact pairs that name it. What else may name a geom are sensors, which no model has.
void leave_out_with_pairs(mjSpec* spec, mjsGeom* geom) {
  const std::string name = name_of(geom->element);
  for_each(spec, mjOBJ_PAIR, mjs_asPair, [&](mjsPair* pair) {
    if (!name.empty() && (spec_text(pair->geomname1) == name || spec_text(pair->geomname2) == name)) {
      mjs_delete(spec, pair->element);
    }
  });
  mjs_delete(spec, geom->element);
}

// An asset without its file, whose geoms are needed.
template <typename Asset>
void add_missing(const mjSpec* spec, const Asset* asset, const std::string& element, const std::string& folder,
                 const std::string& costs, bool drop_missing, LoadReport& report, std::vector<std::string>& notes) {
  Problem problem = {
      .severity = drop_missing ? Severity::kLeftOut : Severity::kRefused,
      .element = element,
      .line = spec_line(asset->info),
      .file = spec_line(asset->info) > 0 ? spec_origin(spec, asset->element) : "",
      .message = fmt::format("is not found (looked for: {})", spec_mesh_path(spec, asset, folder).string()),
      .mend = drop_missing ? "" : "put the file there, or correct its name",
      .option = drop_missing ? "" : "--drop-unsupported, which " + costs};
  if (drop_missing) {
    problem.message += ": --drop-unsupported " + costs;
    notes.push_back(problem_text(problem));
  }
  report.problems.push_back(std::move(problem));
}

void leave_out_missing_fields(mjSpec* spec, const std::string& folder, bool drop_missing, LoadReport& report,
                              std::vector<std::string>& notes) {
  std::map<std::string, mjsHField*> missing;
  for_each(spec, mjOBJ_HFIELD, mjs_asHField, [&](mjsHField* field) {
    std::error_code error;
    const fs::path path = spec_mesh_path(spec, field, folder);
    if (path.empty() || fs::exists(path, error)) return;
    const std::string own = name_of(field->element);
    missing[own.empty() ? path.stem().string() : own] = field;
  });
  for (const auto& [name, field] : missing) {
    add_missing(spec, field, fmt::format("hfield '{}'", name), folder, "leaves out its geoms", drop_missing, report,
                notes);
  }
  if (!drop_missing) return;
  for_each(spec, mjOBJ_GEOM, mjs_asGeom, [&](mjsGeom* geom) {
    if (missing.contains(spec_text(geom->hfieldname))) leave_out_with_pairs(spec, geom);
  });
  for (const auto& [name, field] : missing) mjs_delete(spec, field->element);
}

bool has_moving_part(const mjsBody* body) { return mjs_firstChild(body, mjOBJ_JOINT, 1) != nullptr; }

}  // namespace

void give_vertices(mjSpec* spec, const std::map<std::string, UrdfMesh>& meshes, bool with_faces) {
  for_each(spec, mjOBJ_MESH, mjs_asMesh, [&](mjsMesh* mesh) {
    const auto found = meshes.find(name_of(mesh->element));
    if (found == meshes.end()) return;
    std::vector<float> vertices;
    vertices.reserve(3 * found->second.data.vertices.size());
    for (const Vec3& p : found->second.data.vertices) {
      for (int k = 0; k < 3; ++k) vertices.push_back(static_cast<float>(p[k]));
    }
    mjs_setFloat(mesh->uservert, vertices.data(), static_cast<int>(vertices.size()));
    if (with_faces) {
      std::vector<int> faces;
      faces.reserve(3 * found->second.data.faces.size());
      for (const auto& face : found->second.data.faces) faces.insert(faces.end(), face.begin(), face.end());
      mjs_setInt(mesh->userface, faces.data(), static_cast<int>(faces.size()));
    }
    mjs_setString(mesh->file, "");
    mesh->inertia = mjMESH_INERTIA_CONVEX;
  });
}

void add_motors(mjSpec* spec, const std::vector<std::string>& joints) {
  for (const std::string& joint : joints) {
    mjsActuator* motor = mjs_addActuator(spec, nullptr);
    mjs_setName(motor->element, joint.c_str());
    mjs_setString(motor->target, joint.c_str());
    motor->trntype = mjTRN_JOINT;
  }
}

void leave_out_pictures(mjSpec* spec, const std::string& folder, bool drawn_meshes, bool drop_missing,
                        LoadReport& report, std::vector<std::string>& notes) {
  for_each(spec, mjOBJ_TEXTURE, mjs_asTexture, [](mjsTexture* texture) {
    mjs_setString(texture->file, "");
    mjs_setStringVec(texture->cubefiles, "");
    texture->builtin = mjBUILTIN_FLAT;
    texture->width = texture->height = 1;
  });
  for_each(spec, mjOBJ_SKIN, mjs_asSkin, [&](mjsSkin* skin) { mjs_delete(spec, skin->element); });

  leave_out_missing_fields(spec, folder, drop_missing, report, notes);
  const std::set<std::string> physical = physical_meshes(spec);
  std::map<std::string, mjsMesh*> missing;
  for_each(spec, mjOBJ_MESH, mjs_asMesh, [&](mjsMesh* mesh) {
    if (spec_text(mesh->file).empty()) return;
    std::error_code error;
    if (!fs::exists(spec_mesh_path(spec, mesh, folder), error)) {
      missing[mesh_name(mesh)] = mesh;
    } else if (!drawn_meshes && !mesh->plugin.active && !physical.contains(mesh_name(mesh))) {
      make_small(mesh);
    }
  });
  if (missing.empty()) return;
  std::vector<mjsGeom*> drawn;
  std::map<std::string, std::vector<mjsGeom*>> colliding;  // by mesh
  for_each(spec, mjOBJ_GEOM, mjs_asGeom, [&](mjsGeom* geom) {
    const std::string mesh = spec_text(geom->meshname);
    if (!missing.contains(mesh)) return;
    if (physical.contains(mesh)) {
      colliding[mesh].push_back(geom);
    } else {
      drawn.push_back(geom);
    }
  });
  for (const auto& [name, mesh] : missing) {
    if (!physical.contains(name)) continue;
    const std::string costs =
        fmt::format("leaves out its {}, which {} no contact and no mass then",
                    colliding[name].size() == 1 ? "geom" : "geoms", colliding[name].size() == 1 ? "has" : "have");
    add_missing(spec, mesh, fmt::format("mesh '{}'", name), folder, costs, drop_missing, report, notes);
  }
  if (drop_missing) {
    for (const auto& [name, geoms] : colliding) {
      for (mjsGeom* geom : geoms) leave_out_with_pairs(spec, geom);
      mjs_delete(spec, missing.at(name)->element);
    }
  }
  size_t left_out = 0;
  for (const mjsGeom* geom : drawn) {
    mjs_delete(spec, geom->element);
    ++left_out;
  }
  for (const auto& [name, mesh] : missing) {
    if (!physical.contains(name)) mjs_delete(spec, mesh->element);
  }
  if (left_out > 0) {
    notes.push_back(fmt::format("{} shapes that are only drawn are left out: their mesh files are missing", left_out));
  }
}

void adapt_to_compiler(mjSpec* spec, std::vector<std::string>& notes) {
  spec->compiler.LRopt.mode = mjLRMODE_NONE;
  std::map<std::string, mjsMesh*> meshes;
  for_each(spec, mjOBJ_MESH, mjs_asMesh, [&](mjsMesh* mesh) { meshes[mesh_name(mesh)] = mesh; });
  std::set<std::string> shells;
  for_each(spec, mjOBJ_GEOM, mjs_asGeom, [&](mjsGeom* geom) {
    if (geom->type != mjGEOM_MESH || geom->typeinertia != mjINERTIA_SHELL) return;
    geom->typeinertia = mjINERTIA_VOLUME;
    const auto mesh = meshes.find(spec_text(geom->meshname));
    if (mesh == meshes.end()) return;
    mesh->second->inertia = mjMESH_INERTIA_SHELL;
    shells.insert(fmt::format("'{}'", mesh->first));
  });
  if (shells.empty()) return;
  constexpr size_t kNamed = 5;
  const size_t others = shells.size() > kNamed ? shells.size() - kNamed : 0;
  std::vector<std::string> named(shells.begin(), shells.end());
  named.resize(named.size() - others);
  notes.push_back(fmt::format("shellinertia of mesh geoms is that of their meshes, as MuJoCo 4 writes it: {}{}",
                              join(named, ", "), others > 0 ? fmt::format(" and {} more", others) : ""));
}

void apply_root_joint(mjSpec* spec, RootJoint root, LoadReport& report, std::vector<std::string>& notes) {
  if (root == RootJoint::kAsInFile) return;
  const mjsBody* world = mjs_findBody(spec, "world");
  std::vector<mjsBody*> roots;
  for (mjsElement* e = mjs_firstChild(world, mjOBJ_BODY, 0); e != nullptr; e = mjs_nextChild(world, e, 0)) {
    roots.push_back(mjs_asBody(e));
  }
  size_t changed = 0;
  for (mjsBody* body : roots) {
    mjsElement* first = mjs_firstChild(body, mjOBJ_JOINT, 0);
    if (root == RootJoint::kFixed) {
      if (first == nullptr || mjs_asJoint(first)->type != mjJNT_FREE) continue;
      mjs_delete(spec, first);
      ++changed;
    } else if (first == nullptr && (has_moving_part(body) || roots.size() == 1)) {
      mjs_addFreeJoint(body);
      ++changed;
    }
  }
  const bool fixed = root == RootJoint::kFixed;
  if (changed == 0) {
    if (fixed) {
      notes.emplace_back("--fixed-base changes nothing: no root has a free joint");
    } else {
      report.refuse("no root of the file is fixed to the world and carries moving bodies",
                    "give the body that shall move a <freejoint/>, or leave out --floating-base");
    }
    return;
  }
  size_t keys = 0;
  for_each(spec, mjOBJ_KEY, mjs_asKey, [&](mjsKey* key) {
    mjs_delete(spec, key->element);
    ++keys;
  });
  if (keys > 0) notes.push_back(fmt::format("{} keyframes are left out: they are of another root joint", keys));
}

std::string add_ground(mjSpec* spec, std::vector<std::string>& notes) {
  bool there = false;
  std::set<std::string> names;
  for_each(spec, mjOBJ_GEOM, mjs_asGeom, [&](mjsGeom* geom) {
    names.insert(name_of(geom->element));
    there = there || (geom->type == mjGEOM_PLANE && (geom->contype != 0 || geom->conaffinity != 0));
  });
  if (there) {
    notes.emplace_back("--ground adds nothing: the file has a plane");
    return "";
  }
  std::string name = "ground";
  for (int i = 2; names.contains(name); ++i) name = fmt::format("ground_{}", i);
  mjsGeom* plane = mjs_addGeom(mjs_findBody(spec, "world"), nullptr);
  mjs_setName(plane->element, name.c_str());
  plane->type = mjGEOM_PLANE;
  plane->size[0] = plane->size[1] = 0;  // infinite
  plane->size[2] = 1;
  plane->contype = plane->conaffinity = 0x7fffffff;
  // not those of the file's default class
  plane->condim = 3;
  plane->friction[0] = 1;
  plane->priority = 0;
  plane->margin = plane->gap = 0;
  return name;
}

}  // namespace assay
