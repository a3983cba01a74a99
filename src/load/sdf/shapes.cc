// Collisions of links, and what is computed from them: mass and inertia of <inertial auto="true">.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <numbers>
#include <set>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "load/mesh_facts.h"
#include "load/outside_files.h"
#include "load/package_paths.h"
#include "load/sdf/robot.h"
#include "load/sdf/values.h"

namespace assay::sdf {
namespace {

namespace fs = std::filesystem;

constexpr double kSticks = 1e4;  // a friction coefficient that counts as none too large
constexpr int kSides = 64;       // of the pyramid that stands for a cone

// A ring of points at height z, in the order in which they turn about z.
void add_ring(MeshData& mesh, const std::vector<Vec3>& ring, double z) {
  for (const Vec3& p : ring) mesh.vertices.emplace_back(p.x(), p.y(), z);
}

// The faces of a fan over `count` vertices from `first` on; outward is up, or down.
void add_fan(MeshData& mesh, int first, int count, bool up) {
  for (int i = 1; i + 1 < count; ++i) {
    mesh.faces.push_back(up ? std::array{first, first + i, first + i + 1}
                            : std::array{first, first + i + 1, first + i});
  }
}

// About the origin of the shape's frame, of density 1.
RigidPart solid(const SdfShape& shape, const MeshData* mesh) {
  const Vec3& s = shape.size;
  const double r = s[0], l = s[1], pi = std::numbers::pi;
  RigidPart part;
  const auto about = [&part](double xx, double yy, double zz) { part.I.diagonal() << xx, yy, zz; };
  if (shape.type == "box") {
    part.mass = s.prod();
    about(s[1] * s[1] + s[2] * s[2], s[0] * s[0] + s[2] * s[2], s[0] * s[0] + s[1] * s[1]);
    part.I *= part.mass / 12;
  } else if (shape.type == "sphere") {
    part.mass = 4.0 / 3 * pi * r * r * r;
    about(0.4, 0.4, 0.4);
    part.I *= part.mass * r * r;
  } else if (shape.type == "ellipsoid") {
    part.mass = 4.0 / 3 * pi * s.prod();
    about(s[1] * s[1] + s[2] * s[2], s[0] * s[0] + s[2] * s[2], s[0] * s[0] + s[1] * s[1]);
    part.I *= part.mass / 5;
  } else if (shape.type == "cylinder") {
    part.mass = pi * r * r * l;
    const double across = part.mass * (3 * r * r + l * l) / 12;
    about(across, across, part.mass * r * r / 2);
  } else if (shape.type == "capsule") {
    const double middle = pi * r * r * l, caps = 4.0 / 3 * pi * r * r * r;
    part.mass = middle + caps;
    // a half ball's centre is 3/8 r from its flat side
    const double across = middle * (3 * r * r + l * l) / 12 + caps * (0.4 * r * r + 3.0 / 8 * r * l + l * l / 4);
    about(across, across, middle * r * r / 2 + caps * 0.4 * r * r);
  } else if (shape.type == "cone") {  // the frame is at half of its height
    part.mass = pi * r * r * l / 3;
    part.p.z() = -l / 4;
    const double across = part.mass * (3.0 / 20 * r * r + 3.0 / 80 * l * l);
    about(across, across, part.mass * 0.3 * r * r);
  } else if (mesh != nullptr) {  // tetrahedra from the origin to each triangle
    Vec3 moment = Vec3::Zero();
    Mat3 second = Mat3::Zero();  // integral of p p^T
    for (const auto& [i, j, k] : mesh->faces) {
      const Vec3 &a = mesh->vertices[i], &b = mesh->vertices[j], &c = mesh->vertices[k];
      const double volume = a.dot(b.cross(c)) / 6;
      const Vec3 sum = a + b + c;
      part.mass += volume;
      moment += volume / 4 * sum;
      second += volume / 20 * (a * a.transpose() + b * b.transpose() + c * c.transpose() + sum * sum.transpose());
    }
    if (part.mass <= 0) return {};
    part.p = moment / part.mass;
    second -= part.mass * part.p * part.p.transpose();
    part.I = second.trace() * Mat3::Identity() - second;
  }
  return part;
}

class Shapes {
 public:
  explicit Shapes(Robot& robot) : robot_(robot) {}

  void read() {
    for (Link& link : robot_.links) {
      std::set<std::string> names;
      for (Element c = link.element.child("collision"); c; c = c.next("collision")) add(link, c, names);
      if (sdf::truth(attribute(link.element.child("inertial").at, "auto")).value_or(false)) compute(link);
    }
    if (!directed_.empty()) {
      robot_.note(fmt::format("friction that differs in two directions is the smaller one: {}", join(directed_, ", ")));
    }
    if (!sticking_.empty()) {
      robot_.note(
          fmt::format("friction without a limit (negative in Gazebo) is {:g}: {}", kSticks, join(sticking_, ", ")));
    }
    if (!cones_.empty()) {
      robot_.note(
          fmt::format("cones are pyramids of {} sides, whose edges lie on them: {}", kSides, join(cones_, ", ")));
    }
    if (!concave_.empty()) {
      robot_.note(fmt::format("polylines are their convex hulls: {}", join(concave_, ", ")));
    }
  }

 private:
  void add(Link& link, const Element& collision, std::set<std::string>& names) {
    const std::string own = attribute(collision.at, "name");
    SdfShape shape;
    shape.name = fmt::format("{}::{}", link.name, own.empty() ? "collision" : own);
    for (int i = 2; !names.insert(shape.name).second; ++i) {
      shape.name = fmt::format("{}::{}_{}", link.name, own.empty() ? "collision" : own, i);
    }
    label_ = fmt::format("collision '{}' of link '{}'", own, link.name);
    shape.line = robot_.line_of(fmt::format("geom '{}'", shape.name), collision);
    const Element pose = collision.child("pose");
    shape.X_BS = robot_.pose(pose, label_);
    if (const std::string name = attribute(pose.at, "relative_to"); !name.empty()) {
      const Frame& home = robot_.frames[link.frame];
      const int frame = find_frame(robot_, home.scope, name, home.model);
      if (frame < 0) {
        robot_.refuse(label_, pose, fmt::format("has relative_to '{}', which is no frame of its model", name),
                      "correct it");
        return;
      }
      shape.X_BS = link.X_WL.inverse() * pose_of(robot_, frame) * shape.X_BS;
    }
    const Element geometry = collision.child("geometry");
    const Element of_shape = {geometry ? geometry.at->FirstChildElement() : nullptr, collision.source};
    if (!of_shape) {
      robot_.note(fmt::format("{} ({}) has no shape and is left out", label_, robot_.place(collision)));
      return;
    }
    shape.type = of_shape.at->Name();
    read_surface(collision.child("surface"), shape);
    if (!read_geometry(link, of_shape, shape)) return;
    link.shapes.push_back(std::move(shape));
  }

  bool refuse(const Element& element, const std::string& fault, const std::string& mend) {
    robot_.unsupported(fmt::format("<{}> of {}", element.at->Name(), label_), element, fault, mend,
                       "is left out, so this link does not collide there");
    return false;
  }

  // A size that is above 0.
  bool size(const Element& shape, const char* name, double otherwise, double& value) {
    value = robot_.number(shape, name, otherwise, label_);
    return (value > 0 && std::isfinite(value)) ||
           refuse(shape, fmt::format("has the {} {}", name, shortest(value)), "give a number above 0");
  }
  bool sizes(const Element& shape, const char* name, Vec3& value) {
    value = robot_.vector(shape.child(name), Vec3::Ones(), label_);
    return value.minCoeff() > 0 ||
           refuse(shape,
                  fmt::format("has the {} {} {} {}", name, shortest(value[0]), shortest(value[1]), shortest(value[2])),
                  "give numbers above 0");
  }

  bool read_geometry(const Link& link, const Element& element, SdfShape& shape) {
    const std::string& type = shape.type;
    Vec3& s = shape.size;
    if (type == "empty") return false;
    if (type == "box") return sizes(element, "size", s);
    if (type == "ellipsoid") return sizes(element, "radii", s);
    if (type == "sphere") return size(element, "radius", 1, s[0]);
    if (type == "cylinder" || type == "capsule") {
      return size(element, "radius", type == "capsule" ? 0.5 : 1, s[0]) && size(element, "length", 1, s[1]);
    }
    if (type == "cone") {
      return size(element, "radius", 1, s[0]) && size(element, "length", 1, s[1]) && add_cone(shape);
    }
    if (type == "plane") return read_plane(link, element, shape);
    if (type == "mesh") return read_mesh_of(element, shape);
    if (type == "polyline") return read_polyline(element, shape);
    return refuse(element, "is no shape that is read",
                  "use box, sphere, cylinder, capsule, ellipsoid, cone, plane, polyline or mesh");
  }

  bool read_plane(const Link& link, const Element& element, SdfShape& shape) {
    const Vec3 normal = robot_.vector(element.child("normal"), Vec3::UnitZ(), label_);
    if (normal.norm() < 1e-9) return refuse(element, "has a normal of length 0", "give a direction");
    if (!link.is_static) {
      return refuse(element, "is a plane on a link that moves", "make its model static, or use a thin box");
    }
    shape.X_BS.q = shape.X_BS.q * Quat::FromTwoVectors(Vec3::UnitZ(), normal.normalized());
    return true;
  }

  bool add_cone(SdfShape& shape) {
    MeshData mesh;
    std::vector<Vec3> ring;
    for (int i = 0; i < kSides; ++i) {
      const double angle = 2 * std::numbers::pi * i / kSides;
      ring.emplace_back(shape.size[0] * std::cos(angle), shape.size[0] * std::sin(angle), 0);
    }
    add_ring(mesh, ring, -shape.size[1] / 2);
    mesh.vertices.emplace_back(0, 0, shape.size[1] / 2);
    add_fan(mesh, 0, kSides, false);
    for (int i = 0; i < kSides; ++i) mesh.faces.push_back({i, (i + 1) % kSides, kSides});
    cones_.push_back(label_);
    return keep(fmt::format("cone_{}", shape.name), "", std::move(mesh), shape);
  }

  // Points of a polygon in the xy plane, from z = 0 to the height.
  bool read_polyline(const Element& element, SdfShape& shape) {
    double height = 0;
    if (!size(element, "height", 1, height)) return false;
    if (element.next("polyline")) return refuse(element, "has holes", "use several collisions without holes");
    std::vector<Vec3> ring;
    for (Element p = element.child("point"); p; p = p.next("point")) {
      const std::vector<double> v = robot_.numbers(p, 2, label_);
      if (!v.empty()) ring.emplace_back(v[0], v[1], 0);
    }
    if (ring.size() > 1 && ring.front() == ring.back()) ring.pop_back();
    double area = 0;
    for (size_t i = 0; i < ring.size(); ++i) area += ring[i].cross(ring[(i + 1) % ring.size()]).z() / 2;
    if (ring.size() < 3 || std::abs(area) < 1e-12) return refuse(element, "encloses no area", "give 3 or more points");
    if (area < 0) std::ranges::reverse(ring);
    bool concave = false;
    for (size_t i = 0; i < ring.size(); ++i) {
      const Vec3 &a = ring[i], &b = ring[(i + 1) % ring.size()], &c = ring[(i + 2) % ring.size()];
      concave = concave || (b - a).cross(c - b).z() < -1e-12;
    }
    if (concave) concave_.push_back(label_);
    const int n = static_cast<int>(ring.size());
    MeshData mesh;
    add_ring(mesh, ring, 0);
    add_ring(mesh, ring, height);
    add_fan(mesh, 0, n, false);
    add_fan(mesh, n, n, true);
    for (int i = 0; i < n; ++i) {
      const int next = (i + 1) % n;
      mesh.faces.push_back({i, next, n + next});
      mesh.faces.push_back({i, n + next, n + i});
    }
    return keep(fmt::format("polyline_{}", shape.name), "", std::move(mesh), shape);
  }

  bool read_mesh_of(const Element& element, SdfShape& shape) {
    const std::string uri = text_of(element.child("uri").at);
    const Source& source = *element.source;
    const std::string from = source.path.empty() ? (fs::current_path() / "model.sdf").string() : source.path;
    const FoundFile found = find_resource(uri, from, robot_.options.packages, {.folder = "", .strip_path = false});
    if (uri.empty() || found.path.empty()) {
      const size_t scheme = uri.find("://");
      const std::string name =
          scheme == std::string::npos ? "" : uri.substr(scheme + 3, uri.find('/', scheme + 3) - scheme - 3);
      return refuse(
          element, fmt::format("'{}' is not found (looked for: {})", uri, join(found.looked, ", ")),
          name.empty() ? "put the file there" : fmt::format("name the model's folder with --package {}=DIR", name));
    }
    if (!may_read(robot_, found.path, found.in_package)) {
      return refuse(element,
                    fmt::format("'{}' lies outside the model's folder '{}'", uri,
                                model_root(robot_.path.empty() ? "model.sdf" : robot_.path)),
                    "copy it there, or give --allow-external-files if you trust the model");
    }
    if (!found.taken_for.empty()) {
      robot_.note(fmt::format("<mesh> '{}' of {} ({}) is '{}', {}", uri, label_, robot_.place(element), found.path,
                              found.taken_for));
    }
    const Vec3 scale = robot_.vector(element.child("scale"), Vec3::Ones(), label_);
    const Element submesh = element.child("submesh");
    const std::string part = text_of(submesh.child("name").at);
    const bool centred = robot_.truth(submesh.child("center"), false, label_);
    const std::string key =
        fmt::format("{} {} {} {:.17g} {:.17g} {:.17g}", found.path, part, centred, scale[0], scale[1], scale[2]);
    if (const auto known = meshes_.find(key); known != meshes_.end()) {
      shape.mesh = known->second;
      return true;
    }
    try {
      MeshData mesh = read_mesh(found.path, part);
      if (centred) {
        Vec3 low = mesh.vertices.front(), high = low;
        for (const Vec3& p : mesh.vertices) {
          low = low.cwiseMin(p);
          high = high.cwiseMax(p);
        }
        for (Vec3& p : mesh.vertices) p -= (low + high) / 2;
      }
      for (Vec3& p : mesh.vertices) p = p.cwiseProduct(scale);
      if (scale.prod() < 0) {
        for (auto& face : mesh.faces) std::swap(face[1], face[2]);  // mirrored: outward stays outward
      }
      constexpr double kFlat = 1e-6;
      if (mesh.flatness() < kFlat) {
        return refuse(element, fmt::format("'{}' is flat, so that it has no convex hull", uri), "use a thin box");
      }
      keep(fs::path(found.path).stem().string(), found.path, std::move(mesh), shape);
      meshes_.emplace(key, shape.mesh);
      return true;
    } catch (const InputError& error) {
      const std::string text = error.what();
      const size_t mend = text.rfind("; ");
      return refuse(element, fmt::format("'{}' {}", uri, text.substr(0, mend)),
                    mend == std::string::npos ? "export it again" : text.substr(mend + 2));
    }
  }

  bool keep(std::string stem, const std::string& path, MeshData mesh, SdfShape& shape) {
    std::ranges::replace(stem, '/', '_');
    std::string name = stem;
    auto& meshes = robot_.result.parts.meshes;
    for (int i = 2; meshes.contains(name); ++i) name = fmt::format("{}_{}", stem, i);
    mesh.open_edges = open_edges(mesh.vertices, mesh.faces);
    meshes.emplace(name, UrdfMesh{path, std::move(mesh)});
    shape.mesh = name;
    return true;
  }

  void read_surface(const Element& surface, SdfShape& shape) {
    const Element ode = surface.child("friction").child("ode");
    const Element bullet = surface.child("friction").child("bullet");
    const auto coefficient = [&](const Element& from, const char* name, double otherwise) {
      const double mu = robot_.number(from, name, otherwise, label_);
      if (mu >= 0 && mu <= kSticks) return mu;
      sticking_.push_back(fmt::format("'{}'", shape.name));
      return kSticks;
    };
    double other = 1;
    if (ode || !bullet) {
      shape.friction = coefficient(ode, "mu", 1);
      other = coefficient(ode, "mu2", ode.child("mu2") ? 1 : shape.friction);
    } else {
      shape.friction = coefficient(bullet, "friction", 1);
      other = coefficient(bullet, "friction2", bullet.child("friction2") ? 1 : shape.friction);
    }
    if (other != shape.friction) {
      directed_.push_back(fmt::format("'{}'", shape.name));
      shape.friction = std::min(shape.friction, other);
    }
    const Element contact = surface.child("contact");
    if (const Element mask = contact.child("collide_bitmask")) {
      const std::string text = text_of(mask.at);
      const bool hex = text.starts_with("0x") || text.starts_with("0X");
      const char *begin = text.data() + (hex ? 2 : 0), *end = text.data() + text.size();
      int bits = 0;
      const auto [rest, error] = std::from_chars(begin, end, bits, hex ? 16 : 10);
      if (error == std::errc() && rest == end && begin != end && bits >= 0) {
        shape.bits = bits;
      } else {
        robot_.refuse(label_, mask, fmt::format("has the collide_bitmask '{}'", text),
                      "give a whole number from 0 to 2147483647");
      }
    }
    if (robot_.truth(contact.child("collide_without_contact"), false, label_)) shape.bits = 0;  // a sensor
  }

  // As libsdformat does: all collisions together, scaled to <mass> where it is given.
  void compute(Link& link) {
    const std::string label = fmt::format("link '{}'", link.name);
    const Element inertial = link.element.child("inertial");
    const double otherwise = robot_.number(inertial, "density", 1000, label);
    RigidPart sum;
    for (Element c = link.element.child("collision"); c; c = c.next("collision")) {
      const std::string geom = fmt::format("collision '{}' of {}", attribute(c.at, "name"), label);
      const double density = robot_.number(c, "density", otherwise, geom);
      // the collision's shape, if it was not left out
      const std::string name = fmt::format("{}::{}", link.name, attribute(c.at, "name"));
      const auto shape = std::ranges::find(link.shapes, name, &SdfShape::name);
      if (shape == link.shapes.end() || shape->type == "plane") continue;
      const auto mesh = robot_.result.parts.meshes.find(shape->mesh);
      RigidPart part = solid(*shape, mesh == robot_.result.parts.meshes.end() ? nullptr : &mesh->second.data);
      const Mat3 R = shape->X_BS.q.toRotationMatrix();
      part = {density * part.mass, shape->X_BS * part.p, density * R * part.I * R.transpose()};
      if (part.mass > 0) sum = sum.mass > 0 ? joined(sum, part) : part;
    }
    if (sum.mass <= 0) {
      robot_.refuse(label, inertial, "has auto=\"true\", and no collision with a volume",
                    "give it a <collision>, or a <mass> and an <inertia> without auto");
      return;
    }
    if (const Element mass = inertial.child("mass")) {
      const double wanted = robot_.number(mass, sum.mass, label);
      sum.I *= wanted / sum.mass;
      sum.mass = wanted;
    }
    link.part = sum;
  }

  Robot& robot_;
  std::string label_;
  std::map<std::string, std::string> meshes_;  // file, part and scale -> name
  std::vector<std::string> directed_, sticking_, cones_, concave_;
};

}  // namespace

void read_shapes(Robot& robot) { Shapes(robot).read(); }

void read_masses(Robot& robot) {
  std::vector<std::string> light;
  bool any_gravity = false, all_gravity = true;
  for (Link& link : robot.links) {
    if (link.is_static) continue;
    const std::string label = fmt::format("link '{}'", link.name);
    any_gravity = any_gravity || link.has_gravity;
    all_gravity = all_gravity && link.has_gravity;
    const Element inertial = link.element.child("inertial");
    const std::string is_auto = attribute(inertial.at, "auto");
    if (!is_auto.empty() && !sdf::truth(is_auto)) {
      robot.refuse(label, inertial, fmt::format("has auto=\"{}\"", is_auto), "give true or false");
      continue;
    }
    if (inertial.child("fluid_added_mass")) {
      robot.unsupported(label, inertial.child("fluid_added_mass"), "has a fluid's added mass", "remove it",
                        "is left out");
    }
    if (is_auto.empty() || !*sdf::truth(is_auto)) {
      const Element inertia = inertial.child("inertia");
      const auto entry = [&](const char* name, double otherwise) {
        return robot.number(inertia, name, otherwise, label);
      };
      const double xy = entry("ixy", 0), xz = entry("ixz", 0), yz = entry("iyz", 0);
      Mat3 I;
      I << entry("ixx", 1), xy, xz, xy, entry("iyy", 1), yz, xz, yz, entry("izz", 1);
      const Pose X = robot.pose(inertial.child("pose"), label);
      const Mat3 R = X.q.toRotationMatrix();
      link.part = {robot.number(inertial, "mass", 1, label), X.p, R * I * R.transpose()};
      if (!inertial) light.push_back(fmt::format("'{}'", link.name));
    }
    RigidPart& part = link.part;
    const Element at = inertial ? inertial : link.element;
    if (!std::isfinite(part.mass) || part.mass < 0) {
      robot.refuse(label, at, fmt::format("has the mass {}", shortest(part.mass)), "give a number above 0");
    } else if (part.mass == 0) {
      part = {};
      robot.result.parts.massless.insert(link.name);
    } else if (!part.I.allFinite() || !inertia_valid(part.I)) {
      const bool finite = part.I.allFinite();
      const Vec3 e = finite ? principal_moments(part.I) : Vec3(Vec3::Zero());
      const std::string moments = fmt::format("{:.3g}, {:.3g}, {:.3g}", e[0], e[1], e[2]);
      if (finite && robot.options.repair) {
        part.I = nearest_valid_inertia(part.I, part.mass);
        const Vec3 now = principal_moments(part.I);
        robot.note(fmt::format("repaired: principal moments of {} ({}): {} -> {:.3g}, {:.3g}, {:.3g} kg m^2", label,
                               robot.place(at), moments, now[0], now[1], now[2]));
      } else {
        robot.refuse(label, at,
                     fmt::format("has an inertia that no body can have (principal moments {} kg m^2)", moments),
                     finite ? "correct <inertia>, or give --repair" : "correct <inertia>");
      }
    }
  }
  if (!light.empty()) {
    constexpr size_t kNamed = 5;
    const size_t others = light.size() > kNamed ? light.size() - kNamed : 0;
    light.resize(light.size() - others);
    robot.note(fmt::format("links without <inertial> have 1 kg and 1 kg m^2 about each axis, as SDF says: {}{}",
                           join(light, ", "), others > 0 ? fmt::format(" and {} more", others) : ""));
  }
  if (all_gravity) return;
  if (!any_gravity) {
    robot.result.gravity = Vec3::Zero();
    robot.note("gravity is off: each link that moves has <gravity>false</gravity>");
    return;
  }
  for (const Link& link : robot.links) {
    if (link.is_static || link.has_gravity) continue;
    robot.unsupported(fmt::format("link '{}'", link.name), link.element.child("gravity"),
                      "has no gravity, and others have", "let gravity act on all links or on none",
                      "gets gravity like the others");
  }
}

}  // namespace assay::sdf
