#include "model/translation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "model/kinematics.h"

namespace assay {
namespace {

// ---- helpers --------------------------------------------------------------------------------------------------------

// MuJoCo's arrays hold rows of `width` values.
template <typename T, typename Index>
T* row(T* array, std::ptrdiff_t width, Index index) {
  return array + width * static_cast<std::ptrdiff_t>(index);
}

Vec3 vec3(const mjtNum* array, int index = 0) {
  const mjtNum* v = row(array, 3, index);
  return {v[0], v[1], v[2]};
}

Quat quat(const mjtNum* array, int index = 0) {
  const mjtNum* q = row(array, 4, index);
  return Quat(q[0], q[1], q[2], q[3]).normalized();
}

bool all_zero(const mjtNum* values, int count) {
  return std::ranges::all_of(std::span(values, count), [](mjtNum value) { return value == 0; });
}

const char* geom_type_name(int type) {
  switch (type) {
    case mjGEOM_PLANE:
      return "plane";
    case mjGEOM_HFIELD:
      return "height field";
    case mjGEOM_SPHERE:
      return "sphere";
    case mjGEOM_CAPSULE:
      return "capsule";
    case mjGEOM_ELLIPSOID:
      return "ellipsoid";
    case mjGEOM_CYLINDER:
      return "cylinder";
    case mjGEOM_BOX:
      return "box";
    case mjGEOM_MESH:
      return "mesh";
    case mjGEOM_SDF:
      return "signed distance field";
    default:
      return "shape of unknown type";
  }
}

const char* equality_type_name(int type) {
  switch (type) {
    case mjEQ_CONNECT:
      return "connect";
    case mjEQ_WELD:
      return "weld";
    case mjEQ_JOINT:
      return "joint (in URDF: mimic)";
    case mjEQ_TENDON:
      return "tendon";
    default:
      return "other";
  }
}

// Options that the file sets but the contender decides: names of those that differ from MuJoCo's default.
std::vector<std::string> changed_options(const mjOption& option, const mjOption& standard) {
  std::vector<std::string> names;
  const auto compare = [&](const char* name, auto value, auto normal) {
    if (value != normal) names.emplace_back(name);
  };
  compare("timestep", option.timestep, standard.timestep);
  compare("integrator", option.integrator, standard.integrator);
  compare("solver", option.solver, standard.solver);
  compare("cone", option.cone, standard.cone);
  compare("jacobian", option.jacobian, standard.jacobian);
  compare("impratio", option.impratio, standard.impratio);
  compare("iterations", option.iterations, standard.iterations);
  compare("tolerance", option.tolerance, standard.tolerance);
  compare("ls_iterations", option.ls_iterations, standard.ls_iterations);
  compare("ls_tolerance", option.ls_tolerance, standard.ls_tolerance);
  compare("noslip_iterations", option.noslip_iterations, standard.noslip_iterations);
  compare("noslip_tolerance", option.noslip_tolerance, standard.noslip_tolerance);
  compare("ccd_iterations", option.ccd_iterations, standard.ccd_iterations);
  compare("ccd_tolerance", option.ccd_tolerance, standard.ccd_tolerance);
  compare("sleep_tolerance", option.sleep_tolerance, standard.sleep_tolerance);
  constexpr int kNumericalDisables = mjDSBL_WARMSTART | mjDSBL_REFSAFE | mjDSBL_MIDPHASE | mjDSBL_EULERDAMP |
                                     mjDSBL_AUTORESET | mjDSBL_NATIVECCD | mjDSBL_ISLAND | mjDSBL_MULTICCD;
  for (int bit = 0; bit < mjNDISABLE; ++bit) {
    const int changed = (option.disableflags ^ standard.disableflags) & kNumericalDisables;
    if ((changed & (1 << bit)) != 0) names.push_back(fmt::format("flag {}", mjDISABLESTRING[bit]));
  }
  for (int bit = 0; bit < mjNENABLE; ++bit) {
    const int changed = (option.enableflags ^ standard.enableflags) & ~mjENBL_OVERRIDE;
    if ((changed & (1 << bit)) != 0) names.push_back(fmt::format("flag {}", mjENABLESTRING[bit]));
  }
  return names;
}

// Mass, centre and inertia of rigidly joined parts, all in one body's axes.
struct MassPart {
  double mass = 0;
  Vec3 p = Vec3::Zero();
  Mat3 I = Mat3::Zero();  // about the part's own centre
};

MassPart joined(const std::vector<MassPart>& parts) {
  if (parts.size() == 1) return parts.front();  // no rounding where nothing is fused
  MassPart sum;
  for (const MassPart& part : parts) {
    sum.mass += part.mass;
    sum.p += part.mass * part.p;
  }
  if (sum.mass > 0) sum.p /= sum.mass;
  for (const MassPart& part : parts) {
    const Vec3 d = part.p - sum.p;
    sum.I += part.I + part.mass * (d.squaredNorm() * Mat3::Identity() - d * d.transpose());
  }
  return sum;
}

// ---- translation ----------------------------------------------------------------------------------------------------

// One translation of a compiled mjModel. Its steps run in the order of translate(); each reads the former's results.
class Translation {
 public:
  explicit Translation(const TranslationInput& input) : m_(input.compiled), drop_unsupported_(input.drop_unsupported) {
    read_lines(input.spec);
    for (int i = 0; i < m_->nbody; ++i) body_names_.insert(name(mjOBJ_BODY, i));
    for (int i = 0; i < m_->njnt; ++i) hinge_names_.insert(name(mjOBJ_JOINT, i));
    for (int i = 0; i < m_->ngeom; ++i) shape_names_.insert(name(mjOBJ_GEOM, i));
  }

  Model translate() {
    refuse_foreign_elements();
    translate_options();
    translate_bodies();
    translate_shapes();
    translate_contacts();
    translate_actuators();
    translate_sines();
    translate_keyframes();
    require_finite();
    return std::move(model_);
  }

 private:
  // ---- places and labels for messages

  void read_lines(const mjSpec* spec) {
    const auto note = [&](mjtObj type, auto as) {
      for (mjsElement* e = mjs_firstElement(spec, type); e != nullptr; e = mjs_nextElement(spec, e)) {
        // the parser writes "line 12" here, line 0 in included files; MuJoCo owns the string, so use its accessor
        int line = 0;
        const std::string info = mjs_getString(as(e)->info);
        if (info.starts_with("line ")) line = static_cast<int>(parse_integer(info.substr(5)).value_or(0));
        lines_[{type, mjs_getId(e)}] = line;
      }
    };
    note(mjOBJ_BODY, mjs_asBody);
    note(mjOBJ_JOINT, mjs_asJoint);
    note(mjOBJ_GEOM, mjs_asGeom);
    note(mjOBJ_PAIR, mjs_asPair);
    note(mjOBJ_EQUALITY, mjs_asEquality);
    note(mjOBJ_TENDON, mjs_asTendon);
    note(mjOBJ_ACTUATOR, mjs_asActuator);
    note(mjOBJ_FLEX, mjs_asFlex);
    note(mjOBJ_NUMERIC, mjs_asNumeric);
    note(mjOBJ_KEY, mjs_asKey);
  }

  int line(mjtObj type, int id) const {
    const auto found = lines_.find({type, id});
    const int own = found == lines_.end() ? 0 : found->second;
    if (own > 0) return own;
    if (type == mjOBJ_JOINT) return line(mjOBJ_BODY, m_->jnt_bodyid[id]);
    if (type == mjOBJ_GEOM) return line(mjOBJ_BODY, m_->geom_bodyid[id]);
    return 0;
  }

  std::string name(mjtObj type, int id) const {
    const char* text = mj_id2name(m_, type, id);
    return text == nullptr ? "" : text;
  }

  // "joint 'knee'", "a geom of body 'foot'", "tendon 2": enough for the user to find the element.
  std::string label(mjtObj type, int id) const {
    const char* kind = mju_type2Str(type);
    if (const std::string own = name(type, id); !own.empty()) return fmt::format("{} '{}'", kind, own);
    if (type == mjOBJ_JOINT) return fmt::format("the joint of {}", label(mjOBJ_BODY, m_->jnt_bodyid[id]));
    if (type == mjOBJ_GEOM) {
      const int body = m_->geom_bodyid[id];
      return fmt::format("geom {} of {}", id - m_->body_geomadr[body] + 1, label(mjOBJ_BODY, body));
    }
    return fmt::format("{} number {}", kind, type == mjOBJ_BODY ? id : id + 1);
  }

  std::string located(mjtObj type, int id) const {
    const int number = line(type, id);
    return number > 0 ? fmt::format("{} (line {})", label(type, id), number) : label(type, id);
  }

  [[noreturn]] void refuse(const std::string& what) const { throw InputError(what); }
  [[noreturn]] void refuse(mjtObj type, int id, const std::string& what) const {
    refuse(fmt::format("{} {}", located(type, id), what));
  }

  void note(std::string text) { model_.notes.push_back(std::move(text)); }

  bool disabled(int flag) const { return (m_->opt.disableflags & flag) != 0; }

  // ---- elements that have no counterpart

  void refuse_foreign_elements() {
    if (m_->nflex > 0) {
      refuse(mjOBJ_FLEX, 0, "is deformable, and only rigid bodies are supported; remove it");
    }
    if (m_->ntendon > 0) {
      refuse(mjOBJ_TENDON, 0, "is not supported; remove the tendons, or put springs and actuators on the joints");
    }
    for (int i = 0; i < m_->neq; ++i) {
      if (disabled(mjDSBL_EQUALITY) || disabled(mjDSBL_CONSTRAINT) || !m_->eq_active0[i]) {
        note(fmt::format("{} is inactive and left out", label(mjOBJ_EQUALITY, i)));
        continue;
      }
      refuse(mjOBJ_EQUALITY, i,
             fmt::format("of type {} is not supported; remove it or give it active=\"false\"",
                         equality_type_name(m_->eq_type[i])));
    }
    if (m_->nplugin > 0) refuse("MuJoCo plugins are not supported; remove the plugin elements");
    for (int i = 1; i < m_->nbody; ++i) {
      if (m_->body_mocapid[i] >= 0) {
        refuse(mjOBJ_BODY, i, "is a mocap body, which is not supported; remove mocap=\"true\" to fix it to the world");
      }
      if (m_->body_gravcomp[i] != 0) {
        refuse(mjOBJ_BODY, i, "has gravity compensation, which is not supported; remove gravcomp");
      }
    }
    if (m_->opt.density != 0 || m_->opt.viscosity != 0 || !all_zero(m_->opt.wind, 3)) {
      refuse("a medium (density, viscosity or wind of <option>) is not supported; set them to 0");
    }
    if ((m_->opt.enableflags & mjENBL_OVERRIDE) != 0) {
      refuse("contact override is not supported; remove <flag override> and set friction on the geoms");
    }
    if (m_->nsensor > 0) note(fmt::format("{} sensors are left out: they do not act on the motion", m_->nsensor));
  }

  void translate_options() {
    if (!disabled(mjDSBL_GRAVITY)) {
      model_.gravity = vec3(m_->opt.gravity);
    } else {
      model_.gravity.setZero();
      note("gravity is off: the file disables it");
    }
    const SpecPtr standard(mj_makeSpec());
    const std::vector<std::string> changed = changed_options(m_->opt, standard->option);
    if (!changed.empty()) {
      note(fmt::format("the file's MuJoCo options are ignored, because the contender decides them: {}",
                       join(changed, ", ")));
    }
  }

  // ---- bodies and joints

  void translate_bodies() {
    body_of_.assign(static_cast<size_t>(m_->nbody), kWorld);
    X_MB_.assign(static_cast<size_t>(m_->nbody), Pose{});
    std::vector<std::vector<MassPart>> parts;
    std::vector<std::string> fused;
    for (int b = 1; b < m_->nbody; ++b) {
      const int parent = m_->body_parentid[b];
      const Pose X_MpB = X_MB_[parent] * Pose{vec3(m_->body_pos, b), quat(m_->body_quat, b)};
      if (m_->body_jntnum[b] == 0) {
        body_of_[b] = body_of_[parent];
        X_MB_[b] = X_MpB;
        const int host = body_of_[b];
        fused.push_back(fmt::format("{} into {}", label(mjOBJ_BODY, b),
                                    host == kWorld ? "the world" : fmt::format("'{}'", model_.bodies[host].name)));
      } else {
        add_moving_body(b, X_MpB);
        parts.emplace_back();
      }
      if (const int host = body_of_[b]; host != kWorld && m_->body_mass[b] > 0) {
        const Pose X_MI = X_MB_[b] * Pose{vec3(m_->body_ipos, b), quat(m_->body_iquat, b)};
        const Mat3 R = X_MI.q.toRotationMatrix();
        parts[host].push_back({m_->body_mass[b], X_MI.p, R * vec3(m_->body_inertia, b).asDiagonal() * R.transpose()});
      }
    }
    if (model_.bodies.empty()) {
      refuse("nothing in it can move; give at least one body a <freejoint/> or a hinge joint");
    }
    if (!fused.empty()) note(fmt::format("bodies without a joint are fused, exactly: {}", join(fused, ", ")));

    for (size_t i = 0; i < model_.bodies.size(); ++i) {
      Body& body = model_.bodies[i];
      const MassPart whole = parts[i].empty() ? MassPart{} : joined(parts[i]);
      body.mass = whole.mass;
      body.p_BBcm = whole.p;
      body.I_BBcm_B = (whole.I + whole.I.transpose()) / 2;
      const bool sound = std::isfinite(body.mass) && body.mass > 0 && body.I_BBcm_B.allFinite() &&
                         principal_inertia(body.I_BBcm_B).diagonal.minCoeff() > 0;
      if (!sound) {
        refuse(
            fmt::format("body '{}' has mass {} kg and needs a positive, finite mass and inertia; give it an <inertial> "
                        "or a geom of positive size and density",
                        body.name, shortest(body.mass)));
      }
    }
  }

  void add_moving_body(int b, const Pose& X_MpB) {
    if (m_->body_jntnum[b] > 1) {
      refuse(
          mjOBJ_BODY, b,
          fmt::format("has {} joints, and a body can have one; put a body of its own (with mass and inertia) between "
                      "each two joints",
                      m_->body_jntnum[b]));
    }
    const int j = m_->body_jntadr[b];
    if (m_->jnt_type[j] != mjJNT_HINGE && m_->jnt_type[j] != mjJNT_FREE) {
      refuse(mjOBJ_JOINT, j,
             fmt::format("is a {} joint, and only hinge and free joints are supported; replace it{}",
                         m_->jnt_type[j] == mjJNT_SLIDE ? "slide" : "ball",
                         m_->jnt_type[j] == mjJNT_BALL ? " by three hinges on three bodies" : " or remove it"));
    }
    refuse_joint_extras(j);

    const int index = static_cast<int>(model_.bodies.size());
    Body body;
    body.name = unique_name(name(mjOBJ_BODY, b), fmt::format("body{}", b), body_names_);
    body.parent = body_of_[m_->body_parentid[b]];
    body.X_PB = X_MpB;
    if (m_->jnt_type[j] == mjJNT_HINGE) {
      body.joint = static_cast<int>(model_.joints.size());
      model_.joints.push_back(hinge(j, index, body.name));
    }
    joint_of_.push_back(j);
    body_of_[b] = index;
    model_.bodies.push_back(std::move(body));
  }

  // Properties of MuJoCo's joints that the Model does not have.
  void refuse_joint_extras(int j) {
    const int dof = m_->jnt_dofadr[j];
    const int dofs = m_->jnt_type[j] == mjJNT_FREE ? 6 : 1;
    const bool springs = !disabled(mjDSBL_SPRING), dampers = !disabled(mjDSBL_DAMPER);
    for (int d = dof; d < dof + dofs; ++d) {
      if (m_->dof_frictionloss[d] != 0 && !disabled(mjDSBL_FRICTIONLOSS) && !disabled(mjDSBL_CONSTRAINT)) {
        refuse(mjOBJ_JOINT, j,
               fmt::format("has dry friction {} (frictionloss; in URDF: friction), which is not supported; set it to 0",
                           shortest(m_->dof_frictionloss[d])));
      }
      if (dampers && !all_zero(row(m_->dof_dampingpoly, mjNPOLY, d), mjNPOLY)) {
        refuse(mjOBJ_JOINT, j, "has nonlinear damping, which is not supported; give damping one number");
      }
      if (dofs == 6 && ((dampers && m_->dof_damping[d] != 0) || m_->dof_armature[d] != 0)) {
        refuse(mjOBJ_JOINT, j, "is a free joint with damping or armature, which is not supported; write <freejoint/>");
      }
    }
    if (springs && !all_zero(row(m_->jnt_stiffnesspoly, mjNPOLY, j), mjNPOLY)) {
      refuse(mjOBJ_JOINT, j, "has a nonlinear spring, which is not supported; give stiffness one number");
    }
    if (springs && m_->jnt_springyield[j] != 0) {
      refuse(mjOBJ_JOINT, j, "has a spring that yields, which is not supported; remove springyield");
    }
    if (dofs == 6 && springs && m_->jnt_stiffness[j] != 0) {
      refuse(mjOBJ_JOINT, j, "is a free joint with a spring, which is not supported; write <freejoint/>");
    }
    if (limited(j) && m_->jnt_margin[j] != 0) {
      refuse(mjOBJ_JOINT, j, "has a limit margin, which is not supported; remove it and narrow the range instead");
    }
    if (limited(j) && has_own_softness(row(m_->jnt_solref, mjNREF, j), row(m_->jnt_solimp, mjNIMP, j))) {
      softened_.push_back(label(mjOBJ_JOINT, j));
    }
  }

  bool limited(int j) const { return m_->jnt_limited[j] && !disabled(mjDSBL_LIMIT) && !disabled(mjDSBL_CONSTRAINT); }

  static bool has_own_softness(const mjtNum* solref, const mjtNum* solimp) {
    constexpr std::array<mjtNum, mjNREF> kRef = {0.02, 1};
    constexpr std::array<mjtNum, mjNIMP> kImp = {0.9, 0.95, 0.001, 0.5, 2};
    return !std::ranges::equal(kRef, std::span(solref, mjNREF)) || !std::ranges::equal(kImp, std::span(solimp, mjNIMP));
  }

  Joint hinge(int j, int body, const std::string& body_name) {
    const int dof = m_->jnt_dofadr[j], q = m_->jnt_qposadr[j];
    Joint h;
    h.name = unique_name(name(mjOBJ_JOINT, j), body_name, hinge_names_);
    h.body = body;
    h.p_BJ = vec3(m_->jnt_pos, j);
    h.axis_B = vec3(m_->jnt_axis, j).normalized();
    h.reference = m_->qpos0[q];
    h.limited = limited(j);
    if (h.limited) {
      h.lower = *row(m_->jnt_range, 2, j);
      h.upper = row(m_->jnt_range, 2, j)[1];
    }
    if (!disabled(mjDSBL_SPRING)) h.stiffness = m_->jnt_stiffness[j];
    if (h.stiffness != 0) h.spring_reference = m_->qpos_spring[q];
    if (!disabled(mjDSBL_DAMPER)) h.damping = m_->dof_damping[dof];
    h.armature = m_->dof_armature[dof];
    return h;
  }

  // The file's own name if it has one (MuJoCo keeps names unique), else `fallback`, made unique by an appended number.
  static std::string unique_name(const std::string& own, const std::string& fallback, std::set<std::string>& taken) {
    if (!own.empty()) return own;
    std::string result = fallback;
    for (int i = 2; !taken.insert(result).second; ++i) result = fmt::format("{}_{}", fallback, i);
    return result;
  }

  // ---- shapes and contacts

  void translate_shapes() {
    shape_of_.assign(static_cast<size_t>(m_->ngeom), -1);
    std::vector<std::string> decoration, dropped;
    for (int g = 0; g < m_->ngeom; ++g) {
      const int type = m_->geom_type[g];
      const int body = body_of_[m_->geom_bodyid[g]];
      // MuJoCo itself refuses planes on moving bodies
      if (type == mjGEOM_SPHERE || type == mjGEOM_CAPSULE || (type == mjGEOM_PLANE && body == kWorld)) {
        add_shape(g, body);
        continue;
      }
      const std::string what = fmt::format("{} ({})", label(mjOBJ_GEOM, g), geom_type_name(type));
      if (!may_collide(g)) {
        decoration.push_back(what);
      } else if (drop_unsupported_) {
        dropped.push_back(what);
      } else {
        refuse(mjOBJ_GEOM, g,
               fmt::format(
                   "is of type {}, and only spheres, capsules and planes can collide; replace it, make it visual with "
                   "contype=\"0\" conaffinity=\"0\", or leave it out with --drop-unsupported",
                   geom_type_name(type)));
      }
    }
    if (!decoration.empty()) note(fmt::format("visual shapes are left out: {}", join(decoration, ", ")));
    if (!dropped.empty()) note(fmt::format("collision shapes were dropped as asked: {}", join(dropped, ", ")));
  }

  bool contacts_disabled() const { return disabled(mjDSBL_CONTACT) || disabled(mjDSBL_CONSTRAINT); }

  // True by its own bits or by a <pair>; translate_contacts() finds the partners.
  bool may_collide(int g) const {
    if (contacts_disabled()) return false;
    if (m_->geom_contype[g] != 0 || m_->geom_conaffinity[g] != 0) return true;
    for (int p = 0; p < m_->npair; ++p) {
      if (m_->pair_geom1[p] == g || m_->pair_geom2[p] == g) return true;
    }
    return false;
  }

  void add_shape(int g, int body) {
    const mjtNum* size = row(m_->geom_size, 3, g);
    Shape shape;
    const std::string owner = body == kWorld ? "world" : model_.bodies[body].name;
    shape.name = unique_name(name(mjOBJ_GEOM, g), fmt::format("{}_shape", owner), shape_names_);
    shape.body = body;
    shape.X_BS = X_MB_[m_->geom_bodyid[g]] * Pose{vec3(m_->geom_pos, g), quat(m_->geom_quat, g)};
    shape.friction = *row(m_->geom_friction, 3, g);
    shape.collides = false;  // until a pair is found
    switch (m_->geom_type[g]) {
      case mjGEOM_PLANE:
        shape.type = ShapeType::kPlane;
        break;
      case mjGEOM_SPHERE:
        shape.type = ShapeType::kSphere;
        shape.radius = size[0];
        break;
      default:
        shape.type = ShapeType::kCapsule;
        shape.radius = size[0];
        shape.half_length = size[1];
    }
    // a geom of the default grey takes its material's colour
    const float* rgba = row(m_->geom_rgba, 4, g);
    const std::array<float, 4> grey = {0.5f, 0.5f, 0.5f, 1.0f};
    if (m_->geom_matid[g] >= 0 && std::ranges::equal(grey, std::span(rgba, 4)))
      rgba = row(m_->mat_rgba, 4, m_->geom_matid[g]);
    std::copy_n(rgba, 4, shape.rgba.begin());
    shape_of_[g] = static_cast<int>(model_.shapes.size());
    model_.shapes.push_back(std::move(shape));
  }

  // Applies MuJoCo's collision filter.
  void translate_contacts() {
    if (contacts_disabled()) {
      note("contacts are off: the file disables them");
      return;
    }
    std::set<std::pair<int, int>> seen;  // explicit pairs override the filter
    for (int p = 0; p < m_->npair; ++p) {
      const int g1 = m_->pair_geom1[p], g2 = m_->pair_geom2[p];
      if (shape_of_[g1] < 0 || shape_of_[g2] < 0) continue;  // dropped with a note
      if (!seen.insert(std::minmax(shape_of_[g1], shape_of_[g2])).second) {
        refuse(mjOBJ_PAIR, p, "names two geoms that another pair names too; remove one of the two");
      }
      if (body_of_[m_->geom_bodyid[g1]] == body_of_[m_->geom_bodyid[g2]]) continue;  // rigidly joined: no force acts
      add_explicit_pair(p, g1, g2);
    }
    for (int g1 = 0; g1 < m_->ngeom; ++g1) {
      for (int g2 = g1 + 1; g2 < m_->ngeom; ++g2) {
        if (shape_of_[g1] < 0 || shape_of_[g2] < 0 || !passes_filter(g1, g2)) continue;
        if (!seen.insert(std::minmax(shape_of_[g1], shape_of_[g2])).second) continue;
        add_filtered_pair(g1, g2);
      }
    }
    std::ranges::sort(model_.contacts, {},
                      [](const ContactPair& pair) { return std::pair(pair.shape_a, pair.shape_b); });
    if (!softened_.empty()) {
      note(
          fmt::format("softness of limits and contacts (solref, solimp, solmix, gap) is ignored, because the "
                      "contender decides it: {}",
                      join(softened_, ", ")));
    }
  }

  bool passes_filter(int g1, int g2) const {
    const bool bits = (m_->geom_contype[g1] & m_->geom_conaffinity[g2]) != 0 ||
                      (m_->geom_contype[g2] & m_->geom_conaffinity[g1]) != 0;
    if (!bits) return false;
    const int b1 = m_->geom_bodyid[g1], b2 = m_->geom_bodyid[g2];
    const int a = body_of_[b1], b = body_of_[b2];
    if (a == b) return false;
    // parent and child do not collide, except with what is fixed to the world
    if (!disabled(mjDSBL_FILTERPARENT) && a != kWorld && b != kWorld) {
      if (model_.bodies[a].parent == b || model_.bodies[b].parent == a) return false;
    }
    const int signature = (std::min(b1, b2) << 16) + std::max(b1, b2);
    const std::span excluded(m_->exclude_signature, m_->nexclude);
    return std::ranges::find(excluded, signature) == excluded.end();
  }

  void add_filtered_pair(int g1, int g2) {
    const int p1 = m_->geom_priority[g1], p2 = m_->geom_priority[g2];
    int condim = std::max(m_->geom_condim[g1], m_->geom_condim[g2]);
    double friction = std::max(*row(m_->geom_friction, 3, g1), *row(m_->geom_friction, 3, g2));
    if (p1 != p2) {
      const int winner = p1 > p2 ? g1 : g2;
      condim = m_->geom_condim[winner];
      friction = *row(m_->geom_friction, 3, winner);
    }
    for (const int g : {g1, g2}) {
      if (condim > 3 && m_->geom_condim[g] == condim) refuse_condim(mjOBJ_GEOM, g, condim);
      refuse_contact_extras(g);
    }
    add_contact(g1, g2, condim == 1 ? 0 : friction);
  }

  void add_explicit_pair(int p, int g1, int g2) {
    const mjtNum* friction = row(m_->pair_friction, 5, p);
    const int condim = m_->pair_dim[p];
    if (condim > 3) refuse_condim(mjOBJ_PAIR, p, condim);
    if (condim == 3 && friction[0] != friction[1]) {
      refuse(mjOBJ_PAIR, p, "has a friction that depends on the direction, which is not supported; make both equal");
    }
    if (m_->pair_margin[p] != 0) {
      refuse(mjOBJ_PAIR, p,
             "has a contact margin, which inflates its shapes; remove it and enlarge the shapes instead");
    }
    if (m_->pair_adhesion[p] != 0) refuse(mjOBJ_PAIR, p, "has adhesion, which is not supported; remove it");
    for (const int g : {g1, g2}) {
      if (!all_zero(row(m_->geom_surfacevel, 6, g), 6)) refuse_surface_velocity(g);
    }
    if (has_own_softness(row(m_->pair_solref, mjNREF, p), row(m_->pair_solimp, mjNIMP, p)) || m_->pair_gap[p] != 0 ||
        !all_zero(row(m_->pair_solreffriction, mjNREF, p), mjNREF)) {
      soften(label(mjOBJ_PAIR, p));
    }
    add_contact(g1, g2, condim == 1 ? 0 : friction[0]);
  }

  [[noreturn]] void refuse_condim(mjtObj type, int id, int condim) const {
    refuse(type, id,
           fmt::format(
               "asks for {} friction (condim {}), and only Coulomb friction in the contact plane is supported; set "
               "condim=\"3\"",
               condim == 4 ? "torsional" : "torsional and rolling", condim));
  }

  [[noreturn]] void refuse_surface_velocity(int g) const {
    refuse(mjOBJ_GEOM, g, "has a surface velocity, which is not supported; remove surfacevel");
  }

  void refuse_contact_extras(int g) {
    if (m_->geom_margin[g] != 0) {
      refuse(mjOBJ_GEOM, g, "has a contact margin, which inflates it; remove margin and enlarge the shape instead");
    }
    if (m_->geom_adhesion[g] != 0) refuse(mjOBJ_GEOM, g, "has adhesion, which is not supported; remove it");
    if (!all_zero(row(m_->geom_surfacevel, 6, g), 6)) refuse_surface_velocity(g);
    if (has_own_softness(row(m_->geom_solref, mjNREF, g), row(m_->geom_solimp, mjNIMP, g)) || m_->geom_solmix[g] != 1 ||
        m_->geom_gap[g] != 0) {
      soften(label(mjOBJ_GEOM, g));
    }
  }

  void soften(const std::string& element) {
    if (std::ranges::find(softened_, element) == softened_.end()) softened_.push_back(element);
  }

  void add_contact(int g1, int g2, double friction) {
    const auto [a, b] = std::minmax(shape_of_[g1], shape_of_[g2]);
    model_.shapes[a].collides = model_.shapes[b].collides = true;
    model_.contacts.push_back({a, b, friction});
  }

  // ---- actuators, keyframes

  void translate_actuators() {
    std::map<int, int> per_joint;  // joint -> number of actuators that act on it
    for (int i = 0; i < m_->nactuator; ++i) {
      if (disabled(mjDSBL_ACTUATION) || actuator_group_disabled(i)) {
        note(fmt::format("{} is disabled and left out", label(mjOBJ_ACTUATOR, i)));
        continue;
      }
      Actuator actuator = supported_actuator(i);
      ++per_joint[*row(m_->actuator_trnid, 2, i)];
      actuator_of_.push_back(i);
      model_.actuators.push_back(std::move(actuator));
    }
    for (const auto& [joint, count] : per_joint) {
      if (m_->jnt_actfrclimited[joint]) fold_joint_force_limit(joint, count);
    }
  }

  bool actuator_group_disabled(int i) const {
    const int group = m_->actuator_group[i];
    return group >= 0 && group < 31 && (m_->opt.disableactuator & (1 << group)) != 0;
  }

  Actuator supported_actuator(int i) const {
    const int transmission = m_->actuator_trntype[i];
    const int joint = *row(m_->actuator_trnid, 2, i);
    const bool on_hinge = (transmission == mjTRN_JOINT || transmission == mjTRN_JOINTINPARENT) && joint >= 0 &&
                          m_->jnt_type[joint] == mjJNT_HINGE;
    if (!on_hinge) refuse(mjOBJ_ACTUATOR, i, "does not act on a hinge joint; only actuators on hinges are supported");
    if (m_->actuator_delay[i] != 0 || *row(m_->actuator_history, 2, i) != 0) {
      refuse(mjOBJ_ACTUATOR, i, "has a delay, which is not supported; remove it");
    }
    if (m_->actuator_armature[i] != 0 || m_->actuator_damping[i] != 0 ||
        !all_zero(row(m_->actuator_dampingpoly, mjNPOLY, i), mjNPOLY)) {
      refuse(mjOBJ_ACTUATOR, i, "has armature or damping of its own; give them to the joint instead");
    }
    const mjtNum* gain = row(m_->actuator_gainprm, mjNGAIN, i);
    const mjtNum* bias = row(m_->actuator_biasprm, mjNBIAS, i);
    const bool plain = m_->actuator_dyntype[i] == mjDYN_NONE && m_->actuator_gaintype[i] == mjGAIN_FIXED &&
                       m_->actuator_ctrlnum[i] == 1;
    const bool motor = plain && m_->actuator_biastype[i] == mjBIAS_NONE && gain[0] != 0;
    const bool position = plain && m_->actuator_biastype[i] == mjBIAS_AFFINE && bias[0] == 0 && bias[1] == -gain[0] &&
                          gain[0] > 0 && bias[2] <= 0;
    if (!motor && !position) {
      refuse(mjOBJ_ACTUATOR, i,
             "is neither a plain motor nor a position actuator with kp > 0 and kv >= 0; replace it by one of the two");
    }

    Actuator actuator;
    actuator.name = name(mjOBJ_ACTUATOR, i);
    if (actuator.name.empty()) actuator.name = fmt::format("actuator{}", i + 1);
    actuator.terms = {{.joint = model_.bodies[body_of_[m_->jnt_bodyid[joint]]].joint,
                       .coefficient = *row(m_->actuator_gear, 6, m_->actuator_outadr[i])}};
    actuator.gain = gain[0];
    const int control = m_->actuator_ctrladr[i];
    actuator.control_limited = m_->actuator_ctrllimited[control] && !disabled(mjDSBL_CLAMPCTRL);
    if (actuator.control_limited) {
      actuator.control_lower = *row(m_->actuator_ctrlrange, 2, control);
      actuator.control_upper = row(m_->actuator_ctrlrange, 2, control)[1];
    }
    actuator.force_limited = m_->actuator_forcelimited[i];
    if (actuator.force_limited) {
      actuator.force_lower = *row(m_->actuator_forcerange, 2, i);
      actuator.force_upper = row(m_->actuator_forcerange, 2, i)[1];
    }
    if (position) actuator.bias = {bias[0], bias[1], bias[2]};
    return actuator;
  }

  // actuatorfrcrange of a joint (in URDF: effort) clamps the torque of all its actuators together. With one actuator
  // that is a clamp of its force; without any it has no effect.
  void fold_joint_force_limit(int joint, int actuators) {
    if (actuators > 1) {
      refuse(
          mjOBJ_JOINT, joint,
          "limits the sum of several actuators' forces (actuatorfrcrange), which is not supported; give each actuator "
          "a forcerange");
    }
    const int hinge = model_.bodies[body_of_[m_->jnt_bodyid[joint]]].joint;
    const auto found = std::ranges::find_if(
        model_.actuators, [hinge](const Actuator& actuator) { return actuator.terms[0].joint == hinge; });
    const double gear = found->terms[0].coefficient;
    if (gear == 0) return;
    double lower = *row(m_->jnt_actfrcrange, 2, joint) / gear;
    double upper = row(m_->jnt_actfrcrange, 2, joint)[1] / gear;
    if (lower > upper) std::swap(lower, upper);
    // two clamps in a row equal one clamp to the first range clamped by the second
    if (found->force_limited) {
      lower = std::clamp(found->force_lower, lower, upper);
      upper = std::max(lower, std::min(found->force_upper, upper));
    }
    found->force_limited = true;
    found->force_lower = lower;
    found->force_upper = upper;
  }

  // <numeric name="assay:sine:ACTUATOR" data="amplitude frequency phase"/>
  void translate_sines() {
    constexpr std::string_view kOurs = "assay:", kSine = "assay:sine:";
    for (int n = 0; n < m_->nnumeric; ++n) {
      const std::string own = name(mjOBJ_NUMERIC, n);
      if (!own.starts_with(kOurs)) continue;
      if (!own.starts_with(kSine)) {
        refuse(mjOBJ_NUMERIC, n,
               "is not known to assay; the only known name is assay:sine:ACTUATOR, correct or remove it");
      }
      const std::string target = own.substr(kSine.size());
      const int actuator = mj_name2id(m_, mjOBJ_ACTUATOR, target.c_str());
      if (actuator < 0) {
        refuse(mjOBJ_NUMERIC, n, fmt::format("names the unknown actuator '{}'; correct its name", target));
      }
      const std::span<const mjtNum> data(m_->numeric_data + m_->numeric_adr[n],
                                         static_cast<size_t>(m_->numeric_size[n]));
      if (data.size() != 3 || !std::ranges::all_of(data, [](mjtNum value) { return std::isfinite(value); }) ||
          data[1] < 0) {
        refuse(mjOBJ_NUMERIC, n, "has to have three numbers: amplitude, frequency in Hz (not negative), phase in rad");
      }
      const auto used = std::ranges::find(actuator_of_, actuator);
      if (used == actuator_of_.end()) continue;  // disabled with a note
      model_.actuators[static_cast<size_t>(used - actuator_of_.begin())].sine = {data[0], data[1], data[2]};
    }
  }

  void translate_keyframes() {
    for (int k = 0; k < m_->nkey; ++k) {
      Keyframe key;
      key.name = name(mjOBJ_KEY, k);
      if (key.name.empty()) key.name = fmt::format("key{}", k + 1);
      key.state = keyframe_state(k);
      key.control.reserve(actuator_of_.size());
      for (const int i : actuator_of_) key.control.push_back(row(m_->key_ctrl, m_->nu, k)[m_->actuator_ctrladr[i]]);
      model_.keyframes.push_back(std::move(key));
    }
    if (model_.keyframes.empty()) {
      model_.initial = reference_state(model_);
      model_.control0.assign(model_.actuators.size(), 0.0);
    } else {
      model_.initial = model_.keyframes.front().state;
      model_.initial.time = 0;
      model_.control0 = model_.keyframes.front().control;
    }
  }

  State keyframe_state(int k) const {
    const mjtNum* qpos = row(m_->key_qpos, m_->nq, k);
    const mjtNum* qvel = row(m_->key_qvel, m_->nv, k);
    State state;
    state.time = m_->key_time[k];
    state.bodies.resize(model_.bodies.size());
    state.position.resize(model_.joints.size());
    state.velocity.resize(model_.joints.size());
    for (size_t i = 0; i < model_.bodies.size(); ++i) {
      const Body& body = model_.bodies[i];
      const mjtNum* q = qpos + m_->jnt_qposadr[joint_of_[i]];
      const mjtNum* v = qvel + m_->jnt_dofadr[joint_of_[i]];
      if (!body.is_free()) {
        state.position[body.joint] = q[0];
        state.velocity[body.joint] = v[0];
        continue;
      }
      // MuJoCo: velocity of the body frame's origin in world axes, angular velocity in body axes
      BodyState& s = state.bodies[i];
      s.q_WB = quat(q + 3);
      const Vec3 offset_W = s.q_WB * body.p_BBcm;
      s.p_WBcm = vec3(q) + offset_W;
      s.w_WB = s.q_WB * vec3(v + 3);
      s.v_WBcm = vec3(v) + s.w_WB.cross(offset_W);
    }
    bodies_from_joints(model_, state);
    return state;
  }

  // ---- final check

  void require_finite() const {
    const auto demand = [&](bool finite, const std::string& what) {
      if (!finite) refuse(fmt::format("{} has a value that is not a finite number; correct it", what));
    };
    const auto pose_finite = [](const Pose& X) { return X.p.allFinite() && X.q.coeffs().allFinite(); };
    const auto finite = [](std::initializer_list<double> values) {
      return std::ranges::all_of(values, [](double value) { return std::isfinite(value); });
    };
    demand(model_.gravity.allFinite(), "gravity");
    for (const Body& b : model_.bodies) {
      demand(pose_finite(b.X_PB) && b.p_BBcm.allFinite() && b.I_BBcm_B.allFinite() && std::isfinite(b.mass),
             fmt::format("body '{}'", b.name));
    }
    for (const Joint& h : model_.joints) {
      demand(h.p_BJ.allFinite() && h.axis_B.allFinite() &&
                 finite({h.reference, h.lower, h.upper, h.stiffness, h.spring_reference, h.damping, h.armature}),
             fmt::format("joint '{}'", h.name));
    }
    for (const Shape& s : model_.shapes) {
      demand(pose_finite(s.X_BS) && finite({s.radius, s.half_length, s.friction}), fmt::format("geom '{}'", s.name));
    }
    for (const Actuator& a : model_.actuators) {
      demand(finite({a.terms[0].coefficient, a.gain, a.bias[1], a.bias[2], a.control_lower, a.control_upper,
                     a.force_lower, a.force_upper}),
             fmt::format("actuator '{}'", a.name));
    }
    for (const Keyframe& key : model_.keyframes) {
      const auto body_finite = [](const BodyState& s) {
        return s.p_WBcm.allFinite() && s.q_WB.coeffs().allFinite() && s.v_WBcm.allFinite() && s.w_WB.allFinite();
      };
      const auto number_finite = [](double value) { return std::isfinite(value); };
      demand(std::ranges::all_of(key.state.bodies, body_finite) &&
                 std::ranges::all_of(key.state.position, number_finite) &&
                 std::ranges::all_of(key.state.velocity, number_finite) &&
                 std::ranges::all_of(key.control, number_finite) && std::isfinite(key.state.time),
             fmt::format("keyframe '{}'", key.name));
    }
  }

  const mjModel* m_;
  bool drop_unsupported_;
  Model model_;

  std::map<std::pair<int, int>, int> lines_;  // (object type, id) -> line in the file, 0 when unknown
  std::vector<int> body_of_;                  // MuJoCo body -> index into Model::bodies, kWorld when static
  std::vector<Pose> X_MB_;                    // MuJoCo body's frame in that body (or the world)
  std::vector<int> joint_of_;                 // Model body -> MuJoCo joint
  std::vector<int> shape_of_;                 // MuJoCo geom -> index into Model::shapes, -1 when left out
  std::vector<int> actuator_of_;              // Model actuator -> MuJoCo actuator
  std::set<std::string> body_names_, hinge_names_, shape_names_;  // taken
  std::vector<std::string> softened_;                             // elements whose own softness is ignored
};

}  // namespace

LoadReport translate(const TranslationInput& input) {
  LoadReport report;
  try {
    report.model = Translation(input).translate();
  } catch (const InputError& error) {
    report.refuse(error.what());
  }
  return report;
}

}  // namespace assay
