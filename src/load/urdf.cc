#include "load/urdf.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include <Eigen/Eigenvalues>
#include <fmt/format.h>
#include <tinyxml2.h>

#include "base/errors.h"
#include "base/text.h"
#include "load/inertia.h"
#include "load/outside_files.h"
#include "load/package_paths.h"
#include "load/urdf_compiler.h"
#include "load/urdf_values.h"

namespace assay {
namespace {

namespace fs = std::filesystem;
namespace xml = tinyxml2;
using urdf::number_of;
using urdf::numbers_of;
using urdf::origin_of;
using urdf::text_of;
using urdf::vector_of;

// ---- the document ---------------------------------------------------------------------------------------------------

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

// Writes an element and what is below it; each begins on the line that it has in its document, so that MuJoCo's
// messages name the user's lines.
void write_on_its_line(const xml::XMLElement& element, int& line, std::string& text) {
  for (; line < element.GetLineNum(); ++line) text += '\n';
  text += fmt::format("<{}", element.Name());
  for (const xml::XMLAttribute* a = element.FirstAttribute(); a != nullptr; a = a->Next()) {
    std::string value = escaped(a->Value());
    std::ranges::replace(value, '\n', ' ');
    text += fmt::format(" {}=\"{}\"", a->Name(), value);
  }
  text += '>';
  for (const xml::XMLElement* e = element.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
    write_on_its_line(*e, line, text);
  }
  text += fmt::format("</{}>", element.Name());
}

Mat3 inertia_of(const xml::XMLElement& inertial) {
  const xml::XMLElement* e = inertial.FirstChildElement("inertia");
  const double xy = number_of(e, "ixy", 0), xz = number_of(e, "ixz", 0), yz = number_of(e, "iyz", 0);
  Mat3 I;
  I << number_of(e, "ixx", 0), xy, xz, xy, number_of(e, "iyy", 0), yz, xz, yz, number_of(e, "izz", 0);
  return I;
}

std::string triple(const Vec3& v) { return fmt::format("{:.17g} {:.17g} {:.17g}", v.x(), v.y(), v.z()); }

// How a robot without masses gets them.
constexpr const char* kMassOfShapes =
    "<mujoco><compiler inertiafromgeom=\"auto\"/></mujoco>, which takes the mass of its collision shapes";

// ---- reading --------------------------------------------------------------------------------------------------------

struct Link {
  xml::XMLElement* element = nullptr;
  std::string name;
  int joint = -1;             // to its parent; -1 for the root
  std::vector<int> children;  // joints
  double mass = 0;
  Mat3 I = Mat3::Zero();  // about the centre of mass, in the axes of X_LI
  Pose X_LI;              // inertial frame in the link's
  bool computed = false;  // mass and inertia are not those that the document writes
};

MeshData scaled_mesh(const std::string& path, const Vec3& scale) {
  MeshData mesh = read_mesh(path);
  for (Vec3& p : mesh.vertices) p = p.cwiseProduct(scale);
  if (scale.prod() < 0) {
    for (auto& face : mesh.faces) std::swap(face[1], face[2]);  // mirrored: outward stays outward
  }
  return mesh;
}

struct UrdfJoint {
  xml::XMLElement* element = nullptr;
  std::string name, type;
  int parent = -1, child = -1;
};

// One reading of a document. Its steps run in the order of run(); a step that finds the tree broken ends it.
class Reader {
 public:
  Reader(const std::string& text, std::string path, const LoadOptions& options)
      : path_(std::move(path)), options_(options) {
    document_.Parse(text.data(), text.size());
    if (document_.Error()) return;
    std::map<std::pair<int, std::string>, std::uintptr_t> counted;
    count_elements(*document_.RootElement(), counted);
  }

  UrdfDocument run() {
    if (document_.Error()) {
      refuse("", document_.ErrorLineNum(), fmt::format("is not well-formed XML: {}", document_.ErrorName()),
             "correct it at that line");
      return std::move(result_);
    }
    robot_ = document_.FirstChildElement("robot");
    if (!refuse_xacro() && read_elements() && check_numbers() && build_tree()) {
      note_lines();
      note_unread_parts();
      refuse_loops();
      read_compiler_settings();
      leave_out_pictures();
      check_shapes();
      lock_joints();
      read_inertia();
      apply_root_joint();
      scale_to_total_mass();
      result_.has_mass = std::ranges::any_of(links_, [](const Link& link) { return link.mass > 0; });
      measure_pictures();
      find_massless();
      check_inertia();
      write_inertia();
      adapt_joints();
      adapt_meshes();
      write();
    }
    return std::move(result_);
  }

  // ---- repair

  // What has to change for the inertia, the limits and the joints to be valid, and for meshes to be found from `out`.
  std::vector<AttributeEdit> edits(const std::string& out, std::vector<Mend>& mends) {
    Repairs repairs;
    repairs_ = &repairs;
    if (document_.Error()) throw InputError(fmt::format("{}: it is not well-formed XML and cannot be mended", path_));
    robot_ = document_.FirstChildElement("robot");
    if (refuse_xacro() || !read_elements() || !check_numbers() || !build_tree()) {
      throw InputError(fmt::format("{}: {}", path_, problem_text(result_.problems.front())));
    }
    read_compiler_settings();
    read_inertia();
    find_massless();
    for (const Link& link : links_) mend_inertia(link, repairs.edits, repairs.mends);
    for (const UrdfJoint& joint : joints_) mend_joint(joint, repairs.edits, repairs.mends);
    if (!repairs.mends.empty()) move_meshes(out, repairs.edits, repairs.mends);
    repairs_ = nullptr;
    mends = std::move(repairs.mends);
    return std::move(repairs.edits);
  }

 private:
  void refuse(const std::string& element, int line, std::string message, std::string mend, std::string option = "") {
    result_.problems.push_back({.severity = Severity::kRefused,
                                .element = element,
                                .line = line,
                                .message = std::move(message),
                                .mend = std::move(mend),
                                .option = std::move(option)});
  }
  void leave_out(const std::string& element, int line, const std::string& message) {
    result_.problems.push_back({.severity = Severity::kLeftOut,
                                .element = element,
                                .line = line,
                                .message = message,
                                .mend = {},
                                .option = {}});
    result_.notes.push_back(fmt::format("{} {}", element, message));
  }

  static const xml::XMLElement* xacro_in(const xml::XMLElement& element) {
    if (std::string_view(element.Name()).starts_with("xacro:")) return &element;
    for (const xml::XMLElement* e = element.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      if (const xml::XMLElement* found = xacro_in(*e)) return found;
    }
    return nullptr;
  }

  bool refuse_xacro() {
    const xml::XMLElement* macro = xacro_in(*robot_);
    if (macro == nullptr) return false;
    // never the file itself: the shell empties it first
    const fs::path own = fs::path(path_).filename();
    std::string expanded = own.stem().extension() == ".urdf" ? own.stem().string() : own.stem().string() + ".urdf";
    if (expanded == own) expanded = own.stem().string() + "-expanded.urdf";
    refuse(fmt::format("element '{}'", macro->Name()), macro->GetLineNum(), "is a xacro macro, not URDF",
           fmt::format("expand the file first: xacro {} > {}", path_, expanded));
    return true;
  }

  bool read_elements() {
    std::map<std::string, int> joint_lines;
    for (xml::XMLElement* e = robot_->FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      const std::string kind = e->Name(), name = text_of(e, "name");
      if (kind != "link" && kind != "joint") continue;
      if (name.empty()) {
        refuse(fmt::format("a {}", kind), e->GetLineNum(), "has no name", "give it one");
        continue;
      }
      if (kind == "link") {
        if (const auto [other, fresh] = link_of_.try_emplace(name, static_cast<int>(links_.size())); !fresh) {
          refuse(fmt::format("link '{}'", name), e->GetLineNum(),
                 fmt::format("has the name of the link in line {}", links_[other->second].element->GetLineNum()),
                 "rename one of the two");
          continue;
        }
        links_.emplace_back();
        links_.back().element = e;
        links_.back().name = name;
      } else {
        if (const auto [other, fresh] = joint_lines.try_emplace(name, e->GetLineNum()); !fresh) {
          refuse(fmt::format("joint '{}'", name), e->GetLineNum(),
                 fmt::format("has the name of the joint in line {}", other->second), "rename one of the two");
          continue;
        }
        joints_.push_back({e, name, text_of(e, "type"), -1, -1});
      }
    }
    if (links_.empty() && result_.problems.empty()) {
      refuse("", robot_->GetLineNum(), "the robot has no link", "give it a <link> and a <joint>");
    }
    keep_first_elements();
    return !result_.refused();
  }

  // Of an element that stands twice where one is meant, ROS's reader takes the first; MuJoCo's reads no such file.
  void keep_first(xml::XMLElement& of, const std::string& owner, const std::vector<const char*>& kinds) {
    for (const char* kind : kinds) {
      xml::XMLElement* const first = of.FirstChildElement(kind);
      while (xml::XMLElement* const again = first == nullptr ? nullptr : first->NextSiblingElement(kind)) {
        result_.notes.push_back(fmt::format("{} has a second <{}> in line {}: the first one counts, as in ROS", owner,
                                            kind, again->GetLineNum()));
        of.DeleteChild(again);
      }
    }
  }

  void keep_first_elements() {
    keep_first(*robot_, "the robot", {"mujoco"});
    if (xml::XMLElement* own = robot_->FirstChildElement("mujoco"))
      keep_first(*own, "<mujoco>", {"compiler", "option"});
    for (const Link& link : links_) {
      const std::string owner = fmt::format("link '{}'", link.name);
      keep_first(*link.element, owner, {"inertial"});
      if (xml::XMLElement* inertial = link.element->FirstChildElement("inertial")) {
        keep_first(*inertial, owner, {"origin", "mass", "inertia"});
      }
      for (xml::XMLElement* e = link.element->FirstChildElement("collision"); e != nullptr;
           e = e->NextSiblingElement("collision")) {
        keep_first(*e, owner, {"origin", "geometry"});
      }
      for (xml::XMLElement* e = link.element->FirstChildElement("visual"); e != nullptr;
           e = e->NextSiblingElement("visual")) {
        keep_first(*e, fmt::format("a visual of {}", owner), {"origin", "geometry", "material"});
      }
    }
    for (const UrdfJoint& joint : joints_) {
      keep_first(
          *joint.element, label(joint),
          {"origin", "parent", "child", "axis", "limit", "dynamics", "mimic", "calibration", "safety_controller"});
    }
  }

  static constexpr const char* kExpand = "expand the file first, with xacro";

  // Numbers that every URDF reader takes from these attributes.
  void check_numbers_below(xml::XMLElement& element, const std::string& owner) {
    static const std::map<std::string, std::vector<std::pair<std::string, size_t>>> kAttributes = {
        {"origin", {{"xyz", 3}, {"rpy", 3}}},
        {"axis", {{"xyz", 3}}},
        {"mass", {{"value", 1}}},
        {"inertia", {{"ixx", 1}, {"ixy", 1}, {"ixz", 1}, {"iyy", 1}, {"iyz", 1}, {"izz", 1}}},
        {"dynamics", {{"damping", 1}, {"friction", 1}}},
        {"mimic", {{"multiplier", 1}, {"offset", 1}}},
        {"box", {{"size", 3}}},
        {"cylinder", {{"radius", 1}, {"length", 1}}},
        {"capsule", {{"radius", 1}, {"length", 1}}},
        {"sphere", {{"radius", 1}}},
        {"mesh", {{"scale", 3}}}};
    if (const auto known = kAttributes.find(element.Name()); known != kAttributes.end()) {
      for (const auto& [attribute, count] : known->second) {
        if (element.Attribute(attribute.c_str()) == nullptr) continue;
        const std::vector<double> numbers = numbers_of(&element, attribute.c_str());
        if (numbers.size() == count && std::ranges::all_of(numbers, [](double v) { return std::isfinite(v); }))
          continue;
        if (separated_by_commas(element, attribute, count, owner)) continue;
        refuse(fmt::format("<{}> of {}", element.Name(), owner), element.GetLineNum(),
               fmt::format("has {}=\"{}\"", attribute, text_of(&element, attribute.c_str())),
               text_of(&element, attribute.c_str()).find("$(") != std::string::npos
                   ? kExpand
                   : fmt::format("give {} finite {}", count, count == 1 ? "number" : "numbers"));
      }
    }
    for (xml::XMLElement* e = element.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      if (std::string_view(e->Name()) != "visual") check_numbers_below(*e, owner);
    }
  }

  // True where the numbers are all there with commas between them, which a repair takes out.
  bool separated_by_commas(xml::XMLElement& element, const std::string& attribute, size_t count,
                           const std::string& owner) {
    const std::string value = text_of(&element, attribute.c_str());
    std::string blanks = value;
    std::ranges::replace_if(blanks, [](char c) { return c == ',' || c == ';'; }, ' ');
    if (blanks == value) return false;
    element.SetAttribute(attribute.c_str(), blanks.c_str());
    const std::vector<double> numbers = numbers_of(&element, attribute.c_str());
    if (numbers.size() != count || !std::ranges::all_of(numbers, [](double v) { return std::isfinite(v); })) {
      element.SetAttribute(attribute.c_str(), value.c_str());
      return false;
    }
    const std::string label = fmt::format("<{}> of {}", element.Name(), owner);
    if (repairs_ != nullptr) {
      change(element, attribute.c_str(), blanks, repairs_->edits);
      repairs_->mends.push_back(
          {element.GetLineNum(), fmt::format("{}: {}=\"{}\" -> \"{}\"", label, attribute, value, blanks)});
    } else {
      refuse(label, element.GetLineNum(),
             fmt::format("has {}=\"{}\", with commas between its numbers", attribute, value),
             "write blanks, give --repair, or write a mended file with `assay check FILE --repair OUT`");
    }
    return true;
  }

  // The number of a bound, which may be infinite; NaN for what is none.
  static double bound_of(const xml::XMLElement& limit, const char* attribute) {
    std::string word = text_of(&limit, attribute);
    std::erase_if(word, [](unsigned char c) { return std::isspace(c) != 0; });
    std::ranges::transform(word, word.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    const double sign = word.starts_with('-') ? -1 : 1;
    if (word.starts_with('-') || word.starts_with('+')) word.erase(0, 1);
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    if (word == "inf" || word == "infinity") return sign * kInfinity;
    const auto number = parse_number(word);
    return number ? sign * *number : std::nan("");
  }

  // A bound that no robot reaches is none, which is what people write it for. One alone becomes a number that engines
  // in single precision can hold.
  void check_limit(const UrdfJoint& joint, xml::XMLElement& limit) {
    constexpr double kNone = 1e9, kFar = 1e4;  // rad or m
    for (const char* attribute : {"lower", "upper", "effort"}) {
      if (limit.Attribute(attribute) == nullptr || !std::isnan(bound_of(limit, attribute))) continue;
      refuse(fmt::format("<limit> of {}", label(joint)), limit.GetLineNum(),
             fmt::format("has {}=\"{}\"", attribute, text_of(&limit, attribute)), "give a number, or inf for no limit");
      return;
    }
    if (limit.Attribute("effort") != nullptr && bound_of(limit, "effort") >= kNone) limit.DeleteAttribute("effort");
    const bool bounded = limit.Attribute("lower") != nullptr || limit.Attribute("upper") != nullptr;
    if (!bounded) return;
    const double lower = limit.Attribute("lower") == nullptr ? 0 : bound_of(limit, "lower");
    const double upper = limit.Attribute("upper") == nullptr ? 0 : bound_of(limit, "upper");
    if (lower <= -kNone && upper >= kNone) {
      limit.DeleteAttribute("lower");
      limit.DeleteAttribute("upper");
      return;
    }
    for (const auto& [attribute, bound] : {std::pair("lower", lower), std::pair("upper", upper)}) {
      if (std::abs(bound) < kNone) continue;
      limit.SetAttribute(attribute, bound < 0 ? -kFar : kFar);
      result_.notes.push_back(fmt::format("{} (line {}) has {}=\"{:g}\": {:g} is taken", label(joint),
                                          limit.GetLineNum(), attribute, bound, bound < 0 ? -kFar : kFar));
    }
  }

  // ---- shapes

  // What MuJoCo refuses without a place: shapes that URDF does not know, and sizes that are not positive.
  void check_shapes() {
    for (const Link& link : links_) {
      xml::XMLElement* next = nullptr;
      for (xml::XMLElement* c = link.element->FirstChildElement("collision"); c != nullptr; c = next) {
        next = c->NextSiblingElement("collision");
        if (!keeps_shape(link, *c)) link.element->DeleteChild(c);
      }
    }
  }

  // False for a collision that is left out or refused.
  bool keeps_shape(const Link& link, xml::XMLElement& collision) {
    static const std::map<std::string_view, std::vector<const char*>> kSizes = {{"box", {"size"}},
                                                                                {"cylinder", {"radius", "length"}},
                                                                                {"capsule", {"radius", "length"}},
                                                                                {"sphere", {"radius"}},
                                                                                {"mesh", {}}};
    xml::XMLElement* geometry = collision.FirstChildElement("geometry");
    xml::XMLElement* shape = geometry == nullptr ? nullptr : geometry->FirstChildElement();
    if (shape == nullptr) {
      leave_out(fmt::format("a collision of link '{}'", link.name), collision.GetLineNum(),
                "has no shape and is left out");
      return false;
    }
    const std::string element = fmt::format("<{}> of link '{}'", shape->Name(), link.name);
    while (xml::XMLElement* again = shape->NextSiblingElement()) {
      result_.notes.push_back(
          fmt::format("{} is followed by another shape in its <geometry> (line {}): the first one "
                      "counts, as in ROS",
                      element, again->GetLineNum()));
      geometry->DeleteChild(again);
    }
    const auto fail = [&](const std::string& fault, const std::string& mend) {
      if (options_.drop_unsupported) {
        leave_out(element, shape->GetLineNum(), fault + "; it is left out, so this link does not collide there");
      } else {
        refuse(element, shape->GetLineNum(), fault, mend, "--drop-unsupported, which leaves it out");
      }
      return false;
    };
    const auto sizes = kSizes.find(shape->Name());
    if (sizes == kSizes.end()) return fail("is no shape of URDF", "use box, cylinder, capsule, sphere or mesh");
    for (const char* attribute : sizes->second) {
      const std::vector<double> numbers = numbers_of(shape, attribute);
      if (numbers.empty()) return fail(fmt::format("has no {}", attribute), "give it one");
      const bool negative = std::ranges::any_of(numbers, [](double v) { return v < 0; });
      if (!negative && std::ranges::all_of(numbers, [](double v) { return v > 0; })) continue;
      const std::string fault = fmt::format("has {}=\"{}\"", attribute, text_of(shape, attribute));
      if (negative) return fail(fault, numbers.size() == 1 ? "give a positive number" : "give positive numbers");
      leave_out(element, shape->GetLineNum(), fault + " and is left out: what has no volume touches nothing");
      return false;
    }
    return true;
  }

  // What only draws never refuses a robot: MuJoCo's reader, which takes fewer colours and files than drawing.cc, gets
  // no <visual> but a colour for the shapes that collide.
  void leave_out_pictures() {
    std::map<std::string, std::string> colours;  // by material
    const auto add_colour = [&](const xml::XMLElement& material) {
      const xml::XMLElement* colour = material.FirstChildElement("color");
      const std::vector<double> rgba = numbers_of(colour, "rgba");
      const bool valid = rgba.size() == 4 && std::ranges::all_of(rgba, [](double v) { return std::isfinite(v); });
      if (valid) {
        const std::string own = fmt::format("{} {} {} {}", rgba[0], rgba[1], rgba[2], rgba[3]);
        colours.try_emplace(text_of(&material, "name"), own);
        return own;
      }
      if (colour != nullptr) {
        result_.notes.push_back(fmt::format("<color> in line {} has rgba=\"{}\", which is no colour: grey is drawn",
                                            colour->GetLineNum(), text_of(colour, "rgba")));
      }
      return std::string();
    };
    while (xml::XMLElement* material = robot_->FirstChildElement("material")) {
      add_colour(*material);
      robot_->DeleteChild(material);
    }
    std::map<std::string, std::string> colour_of;  // link -> its last visual's own colour
    std::map<std::string, std::string> material_of;
    for (const Link& link : links_) {
      while (xml::XMLElement* visual = link.element->FirstChildElement("visual")) {
        const xml::XMLElement* geometry = visual->FirstChildElement("geometry");
        if (geometry != nullptr && geometry->FirstChildElement() != nullptr) {
          add_picture(link, origin_of(*visual), *geometry->FirstChildElement());
        } else {
          result_.notes.push_back(fmt::format("a visual of link '{}' (line {}) has no shape and is not drawn",
                                              link.name, visual->GetLineNum()));
        }
        if (const xml::XMLElement* material = visual->FirstChildElement("material")) {
          colour_of[link.name] = add_colour(*material);
          material_of[link.name] = text_of(material, "name");
        }
        link.element->DeleteChild(visual);
      }
    }
    for (const Link& link : links_) {
      std::string& rgba = colour_of[link.name];
      if (const auto known = colours.find(material_of[link.name]); rgba.empty() && known != colours.end()) {
        rgba = known->second;
      }
      if (rgba.empty() || link.element->FirstChildElement("collision") == nullptr) continue;
      // MuJoCo colours what follows
      xml::XMLElement* visual = document_.NewElement("visual");
      link.element->InsertFirstChild(visual);
      visual->InsertNewChildElement("geometry")->InsertNewChildElement("sphere")->SetAttribute("radius", "1");
      xml::XMLElement* material = visual->InsertNewChildElement("material");
      material->SetAttribute("name", link.name.c_str());
      material->InsertNewChildElement("color")->SetAttribute("rgba", rgba.c_str());
    }
  }

  bool check_numbers() {
    for (const Link& link : links_) check_numbers_below(*link.element, fmt::format("link '{}'", link.name));
    for (const UrdfJoint& joint : joints_) {
      check_numbers_below(*joint.element, label(joint));
      if (xml::XMLElement* limit = joint.element->FirstChildElement("limit")) check_limit(joint, *limit);
    }
    return !result_.refused();
  }

  static int line_of(const UrdfJoint& joint) { return joint.element->GetLineNum(); }
  static std::string label(const UrdfJoint& joint) { return fmt::format("joint '{}'", joint.name); }

  bool build_tree() {
    static const std::set<std::string> kTypes = {"revolute", "continuous", "prismatic", "fixed",
                                                 "floating", "planar",     "spherical"};
    add_world();
    std::vector<std::string> names;
    names.reserve(links_.size());
    for (const Link& link : links_) names.push_back(link.name);
    for (size_t j = 0; j < joints_.size(); ++j) {
      UrdfJoint& joint = joints_[j];
      if (!kTypes.contains(joint.type)) {
        refuse(label(joint), line_of(joint),
               joint.type.empty() ? "has no type" : fmt::format("has the type '{}'", joint.type),
               "use revolute, continuous, prismatic, fixed, floating, planar or spherical");
      }
      for (const auto& [end, index] : {std::pair("parent", &joint.parent), std::pair("child", &joint.child)}) {
        const std::string link = text_of(joint.element->FirstChildElement(end), "link");
        const auto found = link_of_.find(link);
        if (found == link_of_.end()) {
          refuse(label(joint), line_of(joint),
                 link.empty() ? fmt::format("has no {} link", end)
                              : fmt::format("names the unknown {} link '{}'{}", end, link, likely(link, names)),
                 link.empty() ? fmt::format("give it a <{} link=\"NAME\"/>", end) : "correct it, or add that link");
        } else {
          *index = found->second;
        }
      }
      if (joint.parent < 0 || joint.child < 0) continue;
      Link& child = links_[joint.child];
      if (child.joint >= 0) {
        refuse(fmt::format("link '{}'", child.name), child.element->GetLineNum(),
               fmt::format("is the child of two joints, '{}' (line {}) and '{}' (line {})", joints_[child.joint].name,
                           line_of(joints_[child.joint]), joint.name, line_of(joint)),
               "remove one: a URDF is a tree");
        continue;
      }
      child.joint = static_cast<int>(j);
      links_[joint.parent].children.push_back(static_cast<int>(j));
    }
    if (result_.refused()) return false;
    return find_order();
  }

  // The names of a large robot help nobody who has misspelled one of them.
  static std::string likely(const std::string& word, const std::vector<std::string>& names) {
    constexpr size_t kMost = 12;
    return names.size() <= kMost || nearest_name(word, names) ? did_you_mean(word, names) : "";
  }

  // Some files hang their root on a world that they do not write down, as Drake's reader lets them.
  void add_world() {
    if (link_of_.contains("world")) return;
    const auto hangs = [](const UrdfJoint& joint) {
      return text_of(joint.element->FirstChildElement("parent"), "link") == "world";
    };
    const auto first = std::ranges::find_if(joints_, hangs);
    if (first == joints_.end()) return;
    result_.notes.push_back(fmt::format("{} (line {}) has the parent 'world', which is no link: it is the world",
                                        label(*first), line_of(*first)));
    xml::XMLElement* world = document_.NewElement("link");
    world->SetAttribute("name", "world");
    robot_->InsertEndChild(world);
    link_of_.emplace("world", static_cast<int>(links_.size()));
    links_.emplace_back();
    links_.back().element = world;
    links_.back().name = "world";
  }

  // The link and all that hang on it, however deep.
  std::vector<int> tree_of(int root) const {
    std::vector<int> links = {root};
    for (size_t k = 0; k < links.size(); ++k) {
      for (const int joint : links_[links[k]].children) links.push_back(joints_[joint].child);
    }
    return links;
  }

  // Leaves out the links and joints that are not reached from this root.
  void keep_tree(int root) {
    const std::vector<int> tree = tree_of(root);
    const std::set<int> kept(tree.begin(), tree.end());
    for (size_t i = 0; i < links_.size(); ++i) {
      if (kept.contains(static_cast<int>(i))) continue;
      const Link& link = links_[i];
      if (link.joint < 0) {
        leave_out(fmt::format("link '{}'", link.name), link.element->GetLineNum(),
                  fmt::format("has no parent and is left out with all that hangs on it: the robot is that of link '{}'",
                              links_[root].name));
      }
      robot_->DeleteChild(link.element);
    }
    for (const UrdfJoint& joint : joints_) {
      if (!kept.contains(joint.child)) robot_->DeleteChild(joint.element);
    }
    links_.clear();
    joints_.clear();
    link_of_.clear();
    order_.clear();
    read_elements();
    build_tree();
  }

  // Parents before children; what is not reached from a root is a cycle.
  bool find_order() {
    std::vector<int> roots;
    for (size_t i = 0; i < links_.size(); ++i) {
      if (links_[i].joint < 0) roots.push_back(static_cast<int>(i));
    }
    order_ = roots;
    for (size_t k = 0; k < order_.size(); ++k) {
      for (const int joint : links_[order_[k]].children) order_.push_back(joints_[joint].child);
    }
    if (order_.size() < links_.size()) {
      std::set<int> reached(order_.begin(), order_.end());
      for (const UrdfJoint& joint : joints_) {
        if (reached.contains(joint.child)) continue;
        refuse(label(joint), line_of(joint),
               fmt::format("closes a cycle: link '{}' is its own ancestor", links_[joint.child].name),
               "remove it: a URDF is a tree");
        return false;
      }
    }
    if (roots.size() > 1) {
      const int largest = *std::ranges::max_element(roots, {}, [this](int root) { return tree_of(root).size(); });
      if (options_.drop_unsupported) {
        keep_tree(largest);
        return !result_.refused();
      }
      refuse("", 0,
             fmt::format("two links have no parent, '{}' (line {}) and '{}' (line {})", links_[roots[0]].name,
                         links_[roots[0]].element->GetLineNum(), links_[roots[1]].name,
                         links_[roots[1]].element->GetLineNum()),
             "join them: a URDF has one root",
             fmt::format("--drop-unsupported, which leaves out all but link '{}' and what hangs on it",
                         links_[largest].name));
      return false;
    }
    return true;
  }

  void note_lines() {
    for (const Link& link : links_) result_.lines[fmt::format("body '{}'", link.name)] = link.element->GetLineNum();
    for (const UrdfJoint& joint : joints_) {
      result_.lines[label(joint)] = line_of(joint);
      if (const xml::XMLElement* mimic = joint.element->FirstChildElement("mimic")) {
        result_.lines[fmt::format("coupling '{}'", joint.name)] = mimic->GetLineNum();
      }
    }
  }

  // ---- what is not read

  struct KnownParts {
    std::vector<std::string> attributes, elements;
  };
  // Of the elements that are read. What stands in others is not looked at: a <material>, an extension.
  static const std::map<std::string, KnownParts>& known_parts() {
    static const std::map<std::string, KnownParts> kKnown = {
        {"robot",
         {{"name", "version"},
          {"link", "joint", "material", "loop_joint", "transmission", "gazebo", "ros2_control", "mujoco"}}},
        {"link", {{"name"}, {"inertial", "visual", "collision"}}},
        {"inertial", {{}, {"origin", "mass", "inertia"}}},
        {"visual", {{"name"}, {"origin", "geometry", "material"}}},
        {"collision", {{"name"}, {"origin", "geometry", "material"}}},
        {"geometry", {{}, {"box", "cylinder", "capsule", "sphere", "mesh"}}},
        {"joint", {{"name", "type"}, {"origin", "parent", "child", "axis", "limit", "dynamics", "mimic"}}},
        {"origin", {{"xyz", "rpy"}, {}}},
        {"mass", {{"value"}, {}}},
        {"inertia", {{"ixx", "ixy", "ixz", "iyy", "iyz", "izz"}, {}}},
        {"box", {{"size"}, {}}},
        {"cylinder", {{"radius", "length"}, {}}},
        {"capsule", {{"radius", "length"}, {}}},
        {"sphere", {{"radius"}, {}}},
        {"mesh", {{"filename", "scale"}, {}}},
        {"parent", {{"link"}, {}}},
        {"child", {{"link"}, {}}},
        {"axis", {{"xyz"}, {}}},
        {"limit", {{"lower", "upper", "effort", "velocity"}, {}}},
        {"dynamics", {{"damping", "friction"}, {}}},
        {"mimic", {{"joint", "multiplier", "offset"}, {}}}};
    return kKnown;
  }

  // Elements or attributes of one kind that are not read.
  struct Unread {
    std::string what;   // "attribute 'low' of <limit>"
    std::string where;  // the first: " of joint 'j' (line 3)"
    std::string hint;   // " (did you mean 'lower'?)"
    size_t count = 1;
  };

  // One note for each kind; extensions of many robots have a few of them, a file that is no robot has any number.
  void note_unread_parts() {
    constexpr size_t kMostKinds = 30;
    std::map<std::string, size_t> index_of;
    std::vector<Unread> kinds;
    size_t others = 0;
    collect_unread(*robot_, "", [&](const std::string& kind) -> Unread* {
      const auto found = index_of.find(kind);
      if (found != index_of.end()) {
        ++kinds[found->second].count;
        return nullptr;
      }
      if (kinds.size() == kMostKinds) {
        ++others;
        return nullptr;
      }
      index_of.emplace(kind, kinds.size());
      return &kinds.emplace_back();
    });
    for (const Unread& unread : kinds) {
      result_.notes.push_back(unread.count == 1
                                  ? fmt::format("{}{} is not read{}", unread.what, unread.where, unread.hint)
                                  : fmt::format("{}{} and {} more are not read{}", unread.what, unread.where,
                                                unread.count - 1, unread.hint));
    }
    if (others > 0) result_.notes.push_back(fmt::format("other elements and attributes that are not read: {}", others));
  }

  // `owner` is the link or joint that the element belongs to, "joint 'j'"; `add` gets each kind, and returns what is to
  // be filled in where it is the first.
  template <typename Add>
  static void collect_unread(const xml::XMLElement& element, const std::string& owner, const Add& add) {
    const auto known = known_parts().find(element.Name());
    if (known == known_parts().end()) return;
    const auto& [attributes, elements] = known->second;
    const std::string tag = element.Name();
    const std::string inside = tag == "link" || tag == "joint" ? "" : fmt::format(" of <{}>", tag);
    const auto report = [&](const std::string& what, const std::string& of, const std::string& name, int line,
                            const std::vector<std::string>& candidates) {
      Unread* unread = add(fmt::format("{} in {}", what, tag));
      if (unread == nullptr) return;
      unread->what = what + of;
      unread->where = fmt::format("{} (line {})", owner.empty() ? "" : " of " + owner, line);
      if (const auto nearest = nearest_name(name, candidates))
        unread->hint = fmt::format(" (did you mean '{}'?)", *nearest);
    };
    for (const xml::XMLAttribute* a = element.FirstAttribute(); a != nullptr; a = a->Next()) {
      const std::string name = a->Name();
      if (name.starts_with("xmlns") || std::ranges::find(attributes, name) != attributes.end()) continue;
      report(fmt::format("attribute '{}'", name), inside, name, element.GetLineNum(), attributes);
    }
    for (const xml::XMLElement* e = element.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      const std::string name = e->Name();
      if (std::ranges::find(elements, name) == elements.end()) {
        report(fmt::format("<{}>", name), tag == "robot" ? "" : inside, name, e->GetLineNum(), elements);
        continue;
      }
      const bool owns = name == "link" || name == "joint";
      collect_unread(*e, owns ? fmt::format("{} '{}'", name, text_of(e, "name")) : owner, add);
    }
  }

  // Not part of URDF, which is a tree, but written by some programs.
  void refuse_loops() {
    for (const xml::XMLElement* e = robot_->FirstChildElement("loop_joint"); e != nullptr;
         e = e->NextSiblingElement("loop_joint")) {
      const std::string element = fmt::format("loop_joint '{}'", text_of(e, "name"));
      if (options_.drop_unsupported) {
        leave_out(element, e->GetLineNum(), "closes a loop of links and is left out, so that the loop is open");
      } else {
        refuse(element, e->GetLineNum(), "closes a loop of links, which is not supported in URDF",
               "write the robot as MJCF with a <connect> or <weld> there",
               "--drop-unsupported, which leaves it out, so that the loop is open");
      }
    }
  }

  // The corners of a shape that is drawn.
  void add_picture(const Link& link, const Pose& X_LV, const xml::XMLElement& shape) {
    const std::string_view type = shape.Name();
    const double radius = number_of(&shape, "radius", 0), length = number_of(&shape, "length", 0);
    Vec3 half = Vec3::Zero();
    if (type == "box") half = vector_of(&shape, "size", Vec3::Zero()) / 2;
    if (type == "sphere") half = Vec3::Constant(radius / std::numbers::sqrt3);
    if (type == "cylinder" || type == "capsule") {
      half = Vec3(radius / std::numbers::sqrt2, radius / std::numbers::sqrt2, length / 2);
    }
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3 at((corner & 1) != 0 ? half.x() : -half.x(), (corner & 2) != 0 ? half.y() : -half.y(),
                    (corner & 4) != 0 ? half.z() : -half.z());
      const Vec3 p_L = X_LV * at;
      if (!half.isZero(0) && p_L.allFinite()) pictures_.emplace_back(link_of_.at(link.name), p_L);
    }
  }

  void measure_pictures() {
    for (const auto& [i, p_L] : pictures_) {
      const int head = head_[static_cast<size_t>(i)];
      double& reach = result_.drawn_reach[links_[static_cast<size_t>(head)].name];
      reach = std::max(reach, (X_HL_[static_cast<size_t>(i)] * p_L - whole_[static_cast<size_t>(head)].p).norm());
    }
  }

  void read_compiler_settings() {
    compiler_ = read_compiler(*robot_, result_.problems, result_.notes);
    for (xml::XMLElement* m = robot_->FirstChildElement("mujoco"); m != nullptr; m = m->NextSiblingElement("mujoco")) {
      xml::XMLElement* next = nullptr;
      for (xml::XMLElement* e = m->FirstChildElement(); e != nullptr; e = next) {
        next = e->NextSiblingElement();
        const std::string name = e->Name();
        if (name == "option") continue;
        if (name != "compiler" && name != "size") {
          result_.notes.push_back(
              fmt::format("<{}> of <mujoco> (line {}) is not read: in URDF MuJoCo reads <compiler> "
                          "and <option>",
                          name, e->GetLineNum()));
        }
        m->DeleteChild(e);
      }
    }
  }

  // ---- joints without a way

  static bool is_scalar(const UrdfJoint& joint) { return joint.type == "revolute" || joint.type == "prismatic"; }

  // Equal limits hold a joint where they are. MuJoCo's reader takes them for none.
  void lock_joints() {
    constexpr double kNoWay = 1e-6;      // rad or m
    std::map<std::string, double> held;  // joint -> where
    for (const UrdfJoint& joint : joints_) {
      xml::XMLElement* limit = joint.element->FirstChildElement("limit");
      if (!is_scalar(joint) || limit == nullptr) continue;
      if (limit->Attribute("lower") == nullptr && limit->Attribute("upper") == nullptr) continue;
      const double lower = number_of(limit, "lower", 0), upper = number_of(limit, "upper", 0);
      if (std::abs(upper - lower) > kNoWay) continue;
      if (joint.element->FirstChildElement("mimic") != nullptr) {
        limit->DeleteAttribute("lower");
        limit->DeleteAttribute("upper");
        result_.notes.push_back(fmt::format("{} (line {}) has equal limits and mimics a joint: the limits are left out",
                                            label(joint), limit->GetLineNum()));
        continue;
      }
      held[joint.name] = (lower + upper) / 2;
    }
    if (held.empty()) return;
    result_.locked = held;
    add_followers(held);
    const bool others_move = std::ranges::any_of(
        joints_, [&](const UrdfJoint& joint) { return joint.type != "fixed" && !held.contains(joint.name); });
    for (UrdfJoint& joint : joints_) {
      const auto found = held.find(joint.name);
      if (found == held.end()) continue;
      xml::XMLElement* limit = joint.element->FirstChildElement("limit");
      if (others_move) {
        hold(joint, found->second);
      } else if (joint.element->FirstChildElement("mimic") == nullptr) {
        // something has to move: a range that engines take for one
        limit->SetAttribute("lower", digits17(found->second - kNoWay).c_str());
        limit->SetAttribute("upper", digits17(found->second + kNoWay).c_str());
        result_.starts[joint.name] = found->second;
      }
    }
    std::vector<std::string> names;
    names.reserve(result_.locked.size());
    for (const auto& [name, position] : result_.locked) names.push_back(fmt::format("'{}' at {:.4g}", name, position));
    constexpr size_t kNamed = 5;
    const size_t others = names.size() > kNamed ? names.size() - kNamed : 0;
    names.resize(names.size() - others);
    result_.notes.push_back(fmt::format("joints {} by their equal limits: {}{}",
                                        others_move ? "that are fixed" : "that are held", join(names, ", "),
                                        others > 0 ? fmt::format(" and {} more", others) : ""));
  }

  // What mimics a joint that is held, is held too.
  void add_followers(std::map<std::string, double>& held) const {
    for (size_t round = 0, before = 0; before != held.size() && round <= joints_.size(); ++round) {
      before = held.size();
      for (const UrdfJoint& joint : joints_) {
        const xml::XMLElement* mimic = joint.element->FirstChildElement("mimic");
        const auto leader = held.find(text_of(mimic, "joint"));
        const bool follows =
            mimic != nullptr && leader != held.end() && (is_scalar(joint) || joint.type == "continuous");
        if (!follows || held.contains(joint.name)) continue;
        held[joint.name] = number_of(mimic, "multiplier", 1) * leader->second + number_of(mimic, "offset", 0);
      }
    }
  }

  // Fixes a joint at this position.
  void hold(UrdfJoint& joint, double position) {
    const Vec3 axis = vector_of(joint.element->FirstChildElement("axis"), "xyz", Vec3::UnitX());
    if (axis.norm() == 0) return;  // refused elsewhere
    Pose moved;
    if (joint.type == "prismatic") {
      moved.p = position * axis.normalized();
    } else {
      moved.q = Eigen::AngleAxisd(position, axis.normalized());
    }
    const Pose X = origin_of(*joint.element) * moved;
    xml::XMLElement* origin = joint.element->FirstChildElement("origin");
    if (origin == nullptr) origin = joint.element->InsertNewChildElement("origin");
    const Mat3 R = X.q.toRotationMatrix();
    const double pitch = std::atan2(-R(2, 0), std::hypot(R(0, 0), R(1, 0)));
    const bool level = std::hypot(R(0, 0), R(1, 0)) > 1e-9;  // else roll and yaw turn about one axis
    const double roll = level ? std::atan2(R(2, 1), R(2, 2)) : std::atan2(-R(1, 2), R(1, 1));
    const double yaw = level ? std::atan2(R(1, 0), R(0, 0)) : 0;
    origin->SetAttribute("xyz", triple(X.p).c_str());
    origin->SetAttribute("rpy", triple(Vec3(roll, pitch, yaw)).c_str());
    if (xml::XMLElement* mimic = joint.element->FirstChildElement("mimic")) joint.element->DeleteChild(mimic);
    set_type(joint, "fixed");
  }

  // ---- root

  // --floating-base hangs the robot on the link "world", which MuJoCo takes for the world; --fixed-base fixes it there.
  void apply_root_joint() {
    Link& root = links_[order_.front()];
    const auto floats = [this](int j) { return joints_[j].type == "floating"; };
    const bool is_object = options_.root_joint == RootJoint::kAsInFile && root.name != "world" && !anything_moves() &&
                           !link_of_.contains("world") && carried_mass(order_.front()) > 0;
    if (is_object) {
      result_.notes.emplace_back(kFreeObject);
    }
    if (options_.root_joint == RootJoint::kFixed) {
      for (const int j : root.children) {
        if (floats(j)) set_type(joints_[j], "fixed");
      }
    }
    if (std::ranges::any_of(root.children, floats)) {
      take_root_for_world();
      return;
    }
    if (options_.root_joint != RootJoint::kFloating && !is_object) return;
    if (root.name == "world") {
      for (const int j : root.children) {
        if (joints_[j].type == "fixed" && root.children.size() == 1) set_type(joints_[j], "floating");
      }
      return;
    }
    if (const auto taken = link_of_.find("world"); taken != link_of_.end()) {
      refuse("link 'world'", links_[taken->second].element->GetLineNum(), "is not the root, and the robot floats",
             "give it another name");
      return;
    }
    xml::XMLElement* world = document_.NewElement("link");
    world->SetAttribute("name", "world");
    robot_->InsertEndChild(world);
    xml::XMLElement* joint = document_.NewElement("joint");
    joint->SetAttribute("name", "floating_base");
    joint->SetAttribute("type", "floating");
    joint->InsertNewChildElement("parent")->SetAttribute("link", "world");
    joint->InsertNewChildElement("child")->SetAttribute("link", root.name.c_str());
    robot_->InsertEndChild(joint);
    const int joint_index = static_cast<int>(joints_.size());
    root.joint = joint_index;
    const int world_index = static_cast<int>(links_.size());
    joints_.push_back({joint, "floating_base", "floating", world_index, order_.front()});
    Link& added = links_.emplace_back();  // `root` may refer to nothing from here on
    added.element = world;
    added.name = "world";
    added.children = {joint_index};
    order_.insert(order_.begin(), world_index);
  }

  // A joint without mass moves nothing; where it is fixed, the rest may be an object.
  bool anything_moves() const {
    return std::ranges::any_of(joints_, [&](const UrdfJoint& joint) {
      return joint.type != "fixed" && (!options_.drop_unsupported || carried_mass(joint.child) > 0);
    });
  }

  // The root is fixed, so what floats on it floats in the world; MuJoCo frees only what hangs on a link of that name.
  void take_root_for_world() {
    Link& root = links_[order_.front()];
    if (root.name == "world") return;
    const auto taken = std::ranges::find(links_, "world", &Link::name);
    if (taken != links_.end()) {
      refuse("link 'world'", taken->element->GetLineNum(), "is not the root, and the robot floats",
             "give it another name");
      return;
    }
    root.name = "world";
    root.element->SetAttribute("name", "world");
    for (const int j : root.children) {
      joints_[j].element->FirstChildElement("parent")->SetAttribute("link", "world");
    }
  }

  static void set_type(UrdfJoint& joint, const char* type) {
    joint.type = type;
    joint.element->SetAttribute("type", type);
  }

  // ---- inertia

  bool moves(const Link& link) const { return link.joint >= 0 && joints_[link.joint].type != "fixed"; }

  void read_inertia() {
    for (Link& link : links_) {
      if (const xml::XMLElement* inertial = link.element->FirstChildElement("inertial")) {
        link.mass = number_of(inertial->FirstChildElement("mass"), "value", 0);
        link.I = inertia_of(*inertial);
        link.X_LI = origin_of(*inertial);
      }
    }
    update_groups();
    if (!compiler_.changes_inertia()) return;
    take_shapes();
    for (Link& link : links_) bound_inertia(link);
    update_groups();
  }

  // The mass of shapes, of fixed links together where MuJoCo fuses them: then those without shapes lose theirs.
  void take_shapes() {
    using From = UrdfCompiler::FromShapes;
    if (compiler_.from_shapes == From::kNever) return;
    const bool always = compiler_.from_shapes == From::kAlways;
    std::vector<bool> has_shapes(links_.size()), in_group(links_.size());
    for (size_t i = 0; i < links_.size(); ++i) {
      has_shapes[i] = links_[i].element->FirstChildElement("collision") != nullptr;
      if (has_shapes[i]) in_group[static_cast<size_t>(head_[i])] = true;
    }
    size_t count = 0;
    for (size_t i = 0; i < links_.size(); ++i) {
      Link& link = links_[i];
      const bool has_own = link.element->FirstChildElement("inertial") != nullptr;
      if (always && !has_shapes[i] && has_own && compiler_.fuses && in_group[static_cast<size_t>(head_[i])]) {
        link.mass = 0;
        link.I = Mat3::Zero();
        link.computed = true;
      }
      if (!has_shapes[i] || (!always && has_own)) continue;
      take_shapes(link);
      ++count;
    }
    result_.notes.push_back(
        fmt::format("{} mass and inertia of {} shapes, as <mujoco><compiler inertiafromgeom=\"{}\"> "
                    "says",
                    count == 1 ? "1 link has the" : fmt::format("{} links have the", count),
                    count == 1 ? "its" : "their", always ? "true" : "auto"));
  }

  void take_shapes(Link& link) {
    const std::vector<SolidShape> shapes = shapes_of(link);
    if (shapes.empty()) return;
    try {
      const RigidPart part = part_of_shapes(shapes);
      link.mass = part.mass;
      link.I = part.I;
      link.X_LI = {part.p, Quat::Identity()};
      link.computed = true;
    } catch (const InputError& error) {
      refuse(fmt::format("link '{}'", link.name), link.element->GetLineNum(),
             fmt::format("has shapes without a mass: {}", error.what()),
             "give it an <inertial>, and leave inertiafromgeom out of <mujoco><compiler>");
    }
  }

  // Its collision shapes that have a volume.
  std::vector<SolidShape> shapes_of(const Link& link) const {
    std::vector<SolidShape> shapes;
    for (const xml::XMLElement* c = link.element->FirstChildElement("collision"); c != nullptr;
         c = c->NextSiblingElement("collision")) {
      const xml::XMLElement* geometry = c->FirstChildElement("geometry");
      const xml::XMLElement* element = geometry == nullptr ? nullptr : geometry->FirstChildElement();
      if (element == nullptr) continue;
      SolidShape shape{.type = element->Name(), .size = Vec3::Zero(), .mesh = {}, .X_LS = origin_of(*c)};
      if (shape.type == "mesh") {
        const FoundFile found = find_mesh(*element);
        if (found.path.empty() || !may_be_read(found)) continue;  // named where it is needed
        try {
          shape.mesh = scaled_mesh(found.path, vector_of(element, "scale", Vec3::Ones()));
        } catch (const InputError&) {
          continue;
        }
      } else if (shape.type == "box") {
        shape.size = vector_of(element, "size", Vec3::Zero());
      } else {
        shape.size = Vec3(number_of(element, "radius", 0), number_of(element, "length", 0), 0);
      }
      shapes.push_back(std::move(shape));
    }
    return shapes;
  }

  // boundmass, boundinertia and balanceinertia of a link, in MuJoCo's order.
  void bound_inertia(Link& link) const {
    if (link.mass < compiler_.bound_mass) {
      link.mass = compiler_.bound_mass;
      link.computed = true;
    }
    if (compiler_.bound_inertia == 0 && !compiler_.balance) return;
    const Eigen::SelfAdjointEigenSolver<Mat3> solver(link.I);
    Vec3 m = solver.eigenvalues();
    const Vec3 as_written = m;
    if (link.mass > 0) m = m.cwiseMax(compiler_.bound_inertia);
    if (compiler_.balance && m[0] > 0 && m[0] + m[1] < m[2]) m.setConstant(m.mean());
    if (m == as_written) return;
    link.I = solver.eigenvectors() * m.asDiagonal() * solver.eigenvectors().transpose();
    link.computed = true;
  }

  // settotalmass scales what moves; MuJoCo fuses what does not into the world, and forgets its mass.
  void scale_to_total_mass() {
    update_groups();
    if (compiler_.total_mass == 0) return;
    double mass = 0;
    for (size_t i = 0; i < links_.size(); ++i) {
      if (!compiler_.fuses || !is_static(static_cast<int>(i))) mass += links_[i].mass;
    }
    if (mass <= 0) return;
    const double scale = compiler_.total_mass / mass;
    for (Link& link : links_) {
      link.mass *= scale;
      link.I *= scale;
      link.computed = true;
    }
    update_groups();
    result_.notes.push_back(
        fmt::format("masses and inertias are scaled by {:.6g}, as <mujoco><compiler "
                    "settotalmass=\"{:g}\"> says",
                    scale, compiler_.total_mass));
  }

  // Links that are fixed to each other: head_ is the one that moves them all, X_HL_ a link's frame in the head's.
  void update_groups() {
    head_.assign(links_.size(), -1);
    X_HL_.assign(links_.size(), Pose{});
    for (const int i : order_) {
      const Link& link = links_[i];
      if (link.joint < 0 || moves(link)) {
        head_[i] = i;
        continue;
      }
      const int parent = joints_[link.joint].parent;
      head_[i] = head_[parent];
      X_HL_[i] = X_HL_[parent] * origin_of(*joints_[link.joint].element);
    }
    whole_.assign(links_.size(), RigidPart{});
    for (const int i : order_) {
      const Link& link = links_[i];
      const Pose X_HI = X_HL_[i] * link.X_LI;
      const Mat3 R = X_HI.q.toRotationMatrix();
      whole_[head_[i]] = joined(whole_[head_[i]], {link.mass, X_HI.p, R * link.I * R.transpose()});
    }
  }

  // Mass that a joint moves. A negative one counts: that is another fault.
  double carried_mass(int link) const {
    double mass = std::abs(links_[link].mass);
    for (const int joint : links_[link].children) mass += carried_mass(joints_[joint].child);
    return mass;
  }

  // Joints that move no mass: they have no dynamics.
  void find_massless() {
    for (const int i : order_) {
      const Link& link = links_[i];
      if (!moves(link) || carried_mass(i) > 0) continue;
      idle_.insert(link.joint);
    }
  }

  static std::string eigenvalues_text(const Vec3& e) { return fmt::format("{:.3g}, {:.3g}, {:.3g}", e[0], e[1], e[2]); }

  bool is_static(int link) const { return head_[link] == order_.front(); }

  void check_inertia() {
    for (const int joint : idle_) {
      UrdfJoint& j = joints_[joint];
      if (options_.drop_unsupported) {
        set_type(j, "fixed");
        leave_out(label(j), line_of(j),
                  "moves no mass and is fixed: it has no dynamics, and what is drawn there does not move");
      } else {
        refuse(label(j), line_of(j), "moves no mass: link '" + links_[j.child].name + "' and what it carries have none",
               fmt::format("give the link an <inertial>{}, or make the joint fixed",
                           carries_shapes(j.child) ? fmt::format(" or the robot {}", kMassOfShapes) : ""),
               "--drop-unsupported, which fixes it");
      }
    }
    if (!idle_.empty()) update_groups();
    for (const int i : order_) check_link(i);
  }

  bool carries_shapes(int link) const {
    return links_[link].element->FirstChildElement("collision") != nullptr ||
           std::ranges::any_of(links_[link].children, [&](int joint) { return carries_shapes(joints_[joint].child); });
  }

  static constexpr const char* kMendInertia =
      "correct <inertia>, give --repair, or write a mended file with `assay check FILE --repair OUT`";

  void check_link(int i) {
    const Link& link = links_[i];
    const xml::XMLElement* inertial = link.element->FirstChildElement("inertial");
    const std::string name = fmt::format("link '{}'", link.name);
    const int line = inertial == nullptr ? link.element->GetLineNum() : inertial->GetLineNum();
    if (link.mass < 0) {
      refuse(name, line, fmt::format("has the mass {} kg", shortest(link.mass)), "give a positive mass");
      return;
    }
    if (is_static(i)) return;
    if (head_[i] == i && whole_[i].mass == 0 && joints_[link.joint].type == "floating") {
      refuse(name, line, "is free and has no mass",
             fmt::format("give it an <inertial>{}, or leave out --floating-base",
                         carries_shapes(i) ? fmt::format(" or the robot {}", kMassOfShapes) : ""));
      return;
    }
    const bool whole_valid = whole_[head_[i]].mass == 0 || inertia_valid(whole_[head_[i]].I);
    const Vec3 own = principal_moments(link.I);
    const bool own_zero = link.I.isZero(0);
    const bool own_valid = own_zero ? true : inertia_possible(link.I);
    if (!own_valid || (link.mass == 0 && !own_zero)) {
      std::string fault = "has inertia without mass";
      if (link.mass != 0 && own[0] <= 0) {
        fault = fmt::format("has an inertia that is not positive (principal moments {} kg m^2)", eigenvalues_text(own));
      } else if (link.mass != 0) {
        fault = fmt::format(
            "has an inertia that breaks the triangle inequality (principal moments {} kg m^2: {:.3g} + {:.3g} < "
            "{:.3g})",
            eigenvalues_text(own), own[0], own[1], own[2]);
      }
      if (whole_valid) {
        result_.notes.push_back(fmt::format(
            "{} (line {}) {}; it stays, because the inertia of all links that are fixed to each other is valid", name,
            line, fault));
      } else {
        refuse(name, line, fault, link.mass == 0 ? "give it a <mass>, or remove its <inertial>" : kMendInertia);
      }
      return;
    }
    if (head_[i] == i && whole_[i].mass > 0 && !whole_valid) {
      // every part may be possible and the whole still be a point or a line
      for (size_t k = 0; k < links_.size(); ++k) {
        if (head_[k] != i) continue;
        if (links_[k].mass < 0 || (!inertia_possible(links_[k].I) && !links_[k].I.isZero(0))) return;  // named there
      }
      const bool missing = inertial != nullptr && inertial->FirstChildElement("inertia") == nullptr;
      refuse(name, line,
             missing ? "has a mass and no <inertia>"
                     : fmt::format("has an inertia that is not positive (principal moments {} kg m^2)",
                                   eigenvalues_text(principal_moments(whole_[i].I))),
             missing ? "give it one, or give --repair, which computes it from the link's shapes" : kMendInertia);
    }
  }

  // MuJoCo compiles links one by one: it gets the whole where a part would be refused, and a placeholder where there is
  // no mass.
  void write_inertia() {
    for (const int h : order_) {
      if (head_[h] != h) continue;
      std::vector<int> parts;
      for (const int i : order_) {
        if (head_[i] == h) parts.push_back(i);
      }
      const bool fixed = h == order_.front();
      const bool plain = std::ranges::all_of(parts, [&](int i) {
        if (links_[i].computed) return false;
        return links_[i].element->FirstChildElement("inertial") == nullptr ||
               (links_[i].mass > 0 && inertia_valid(links_[i].I) && compiles({links_[i].mass, {}, links_[i].I}));
      });
      if (plain && !fixed && links_[h].mass > 0) continue;
      for (const int i : parts) {
        if (xml::XMLElement* own = links_[i].element->FirstChildElement("inertial"))
          links_[i].element->DeleteChild(own);
      }
      if (fixed) continue;
      RigidPart whole = whole_[h];
      if (whole.mass == 0) {
        result_.massless.insert(links_[h].name);
        whole = {1, Vec3::Zero(), Mat3::Identity()};
      } else if (!compiles(whole)) {
        result_.inertia.emplace(links_[h].name, whole);
        whole = {1, Vec3::Zero(), Mat3::Identity()};
      }
      add_inertial(links_[h].element, whole);
    }
  }

  // MuJoCo takes less for nothing.
  static bool compiles(const RigidPart& part) {
    constexpr double kLeast = 1e-12;  // kg, kg m^2
    return part.mass > kLeast && principal_moments(part.I)[0] > kLeast;
  }

  static void add_inertial(xml::XMLElement* link, const RigidPart& part) {
    xml::XMLElement* inertial = link->InsertNewChildElement("inertial");
    inertial->InsertNewChildElement("origin")->SetAttribute("xyz", triple(part.p).c_str());
    inertial->InsertNewChildElement("mass")->SetAttribute("value", digits17(part.mass).c_str());
    xml::XMLElement* inertia = inertial->InsertNewChildElement("inertia");
    constexpr std::array<std::pair<const char*, std::pair<int, int>>, 6> kEntries = {
        {{"ixx", {0, 0}}, {"ixy", {0, 1}}, {"ixz", {0, 2}}, {"iyy", {1, 1}}, {"iyz", {1, 2}}, {"izz", {2, 2}}}};
    for (const auto& [name, at] : kEntries) {
      inertia->SetAttribute(name, digits17(part.I(at.first, at.second)).c_str());
    }
  }

  // ---- joints

  void adapt_joints() {
    open_mimic_cycles();
    size_t velocities = 0, unlimited = 0;
    for (UrdfJoint& joint : joints_) {
      xml::XMLElement* limit = joint.element->FirstChildElement("limit");
      if (limit != nullptr && (joint.type == "continuous" || joint.type == "fixed" || joint.type == "floating")) {
        limit->DeleteAttribute("lower");
        limit->DeleteAttribute("upper");
      } else if (limit != nullptr && (limit->Attribute("lower") != nullptr || limit->Attribute("upper") != nullptr)) {
        const double lower = number_of(limit, "lower", 0), upper = number_of(limit, "upper", 0);
        if (lower > upper) {
          refuse(label(joint), limit->GetLineNum(),
                 fmt::format("has a lower limit {} above its upper limit {}", shortest(lower), shortest(upper)),
                 "swap them, give --repair, or write a mended file with `assay check FILE --repair OUT`");
        }
        if (limit->Attribute("lower") == nullptr) limit->SetAttribute("lower", "0");
        if (limit->Attribute("upper") == nullptr) limit->SetAttribute("upper", "0");
      }
      if (joint.type == "spherical" && limit != nullptr && number_of(limit, "lower", 0) != 0) {
        result_.notes.push_back(
            fmt::format("{} (line {}) is spherical, and its limits are not read: only a largest "
                        "angle, with lower=\"0\", is one",
                        label(joint), limit->GetLineNum()));
        limit->DeleteAttribute("lower");
        limit->DeleteAttribute("upper");
      }
      const xml::XMLElement* axis = joint.element->FirstChildElement("axis");
      if (joint.type != "fixed" && joint.type != "floating" && axis != nullptr &&
          vector_of(axis, "xyz", Vec3::UnitX()).norm() < 1e-9) {
        refuse(label(joint), axis->GetLineNum(), fmt::format("has the axis {}", text_of(axis, "xyz")),
               "give a direction that is not zero");
      }
      if (joint.type == "floating" && joint.parent != order_.front()) {
        refuse(label(joint), line_of(joint), "is floating and not at the root",
               "make it fixed, or make its parent the root link");
      }
      adapt_mimic(joint);
      if (joint.type != "revolute" && joint.type != "continuous" && joint.type != "prismatic") continue;
      if (limit != nullptr && limit->Attribute("velocity") != nullptr) ++velocities;
      if (joint.element->FirstChildElement("mimic") != nullptr) continue;
      result_.driven.push_back(joint.name);
      if (number_of(limit, "effort", 0) <= 0) ++unlimited;
    }
    if (unlimited > 0) {
      result_.notes.push_back(
          fmt::format("motors without a limit, because the effort limit is not above 0: {}", unlimited));
    }
    if (velocities > 0) {
      result_.notes.push_back(
          fmt::format("velocity limits are not used, because no engine here has them: {}", velocities));
    }
    note_elements("transmission", "transmissions", "every joint that is not fixed and mimics none has a motor");
    note_elements("gazebo", "gazebo extensions", "they are another program's");
    note_elements("ros2_control", "ros2_control blocks", "they are another program's");
  }

  void note_elements(const char* name, const char* plural, const char* why) {
    size_t count = 0;
    for (const xml::XMLElement* e = robot_->FirstChildElement(name); e != nullptr; e = e->NextSiblingElement(name)) {
      ++count;
    }
    if (count > 0) result_.notes.push_back(fmt::format("{} are not read ({}): {}", plural, count, why));
  }

  void refuse_mimic(UrdfJoint& joint, xml::XMLElement& mimic, const std::string& fault, const std::string& mend) {
    if (options_.drop_unsupported) {
      leave_out(label(joint), mimic.GetLineNum(), fault + ": its <mimic> is left out, so that it moves freely");
      joint.element->DeleteChild(&mimic);
    } else {
      refuse(label(joint), mimic.GetLineNum(), fault, mend,
             "--drop-unsupported, which removes it, so that the joint moves freely");
    }
  }

  // Joints that mimic each other in a circle: their position follows from nothing, and may contradict itself.
  void open_mimic_cycles() {
    std::map<std::string, int> index_of;
    for (size_t j = 0; j < joints_.size(); ++j) index_of.emplace(joints_[j].name, static_cast<int>(j));
    std::vector<int> leader(joints_.size(), -1);
    for (size_t j = 0; j < joints_.size(); ++j) {
      const xml::XMLElement* mimic = joints_[j].element->FirstChildElement("mimic");
      const auto found = index_of.find(text_of(mimic, "joint"));
      if (mimic == nullptr || joints_[j].type == "fixed" || found == index_of.end()) continue;
      if (joints_[found->second].type != "fixed") leader[j] = found->second;
    }
    std::vector<size_t> walk_of(joints_.size(), 0);  // the walk that came there first, from 1
    for (size_t start = 0; start < joints_.size(); ++start) {
      std::vector<int> way;
      int j = static_cast<int>(start);
      for (; j >= 0 && walk_of[j] == 0; j = leader[j]) {
        walk_of[j] = start + 1;
        way.push_back(j);
      }
      if (j < 0 || walk_of[j] != start + 1) continue;
      std::vector<std::string> between;
      for (auto k = std::ranges::find(way, j) + 1; k != way.end(); ++k) {
        between.push_back(fmt::format("'{}'", joints_[*k].name));
      }
      const std::string through = between.empty() ? "" : fmt::format(" by way of {}", join(between, ", "));
      refuse_mimic(joints_[j], *joints_[j].element->FirstChildElement("mimic"), "mimics itself" + through,
                   between.empty() ? "name another joint in <mimic>" : "remove <mimic> from one of them");
    }
  }

  void adapt_mimic(UrdfJoint& joint) {
    xml::XMLElement* mimic = joint.element->FirstChildElement("mimic");
    if (mimic == nullptr) return;
    const std::string target = text_of(mimic, "joint");
    const auto found = std::ranges::find(joints_, target, &UrdfJoint::name);
    if (joint.type == "fixed") {
      joint.element->DeleteChild(mimic);
    } else if (found == joints_.end()) {
      std::vector<std::string> names;
      names.reserve(joints_.size());
      for (const UrdfJoint& other : joints_) names.push_back(other.name);
      refuse_mimic(joint, *mimic,
                   fmt::format("mimics the unknown joint '{}'{}", target,
                               nearest_name(target, names) ? did_you_mean(target, names) : ""),
                   "correct <mimic>");
    } else if (found->type == "fixed") {
      if (options_.drop_unsupported) {
        leave_out(label(joint), mimic->GetLineNum(),
                  fmt::format("mimics joint '{}', which is fixed: it moves freely instead", target));
        joint.element->DeleteChild(mimic);
      } else {
        refuse(label(joint), mimic->GetLineNum(), fmt::format("mimics joint '{}', which is fixed", target),
               "make both fixed or remove <mimic>",
               "--drop-unsupported, which removes it, so that the joint moves freely");
      }
    }
  }

  // ---- meshes

  void adapt_meshes() {
    for (Link& link : links_) {
      xml::XMLElement* next = nullptr;
      for (xml::XMLElement* c = link.element->FirstChildElement("collision"); c != nullptr; c = next) {
        next = c->NextSiblingElement("collision");
        xml::XMLElement* geometry = c->FirstChildElement("geometry");
        xml::XMLElement* mesh = geometry == nullptr ? nullptr : geometry->FirstChildElement("mesh");
        if (mesh != nullptr && !adapt_mesh(link, *mesh)) link.element->DeleteChild(c);
      }
    }
  }

  // False when the mesh cannot be used and was left out or refused.
  bool adapt_mesh(const Link& link, xml::XMLElement& mesh) {
    const std::string uri = text_of(&mesh, "filename");
    const std::string element = fmt::format("collision mesh '{}' of link '{}'", uri, link.name);
    const auto fail = [&](const std::string& message, const std::string& mend) {
      if (options_.drop_unsupported) {
        leave_out(element, mesh.GetLineNum(), message + "; it is left out, so this link does not collide there");
      } else {
        refuse(element, mesh.GetLineNum(), message, mend, "--drop-unsupported, which leaves it out");
      }
      return false;
    };
    const FoundFile found = find_mesh(mesh);
    if (found.path.empty() && uri.find("$(") != std::string::npos) {
      return fail("names an argument of xacro", kExpand);
    }
    if (found.path.empty()) {
      const std::string package =
          uri.substr(0, uri.find('/', uri.find("//") == std::string::npos ? 0 : uri.find("//") + 2));
      return fail(fmt::format("is not found (looked for: {})", join(found.looked, ", ")),
                  uri.find("://") == std::string::npos ? "put the file there"
                                                       : fmt::format("name its package's folder with --package {}=DIR",
                                                                     package.substr(package.find("//") + 2)));
    }
    if (!may_be_read(found)) {
      return fail(fmt::format("lies outside the model's folder '{}'", model_root(path_)),
                  "copy it there, or give --allow-external-files if you trust the model");
    }
    if (!found.taken_for.empty()) {
      result_.notes.push_back(
          fmt::format("{} (line {}) is '{}', {}", element, mesh.GetLineNum(), found.path, found.taken_for));
    }
    const Vec3 scale = vector_of(&mesh, "scale", Vec3::Ones());
    mesh.DeleteAttribute("scale");
    const std::string key = fmt::format("{} {}", found.path, triple(scale));
    const auto [known, fresh] = mesh_names_.try_emplace(key, "");
    if (fresh) {
      try {
        known->second = add_mesh(found.path, scale);
      } catch (const InputError& error) {
        mesh_names_.erase(known);
        const std::string text = error.what();
        const size_t mend = text.rfind("; ");
        return fail(text.substr(0, mend), mend == std::string::npos ? "export it again" : text.substr(mend + 2));
      }
    }
    mesh.SetAttribute("filename", (known->second + ".stl").c_str());
    return true;
  }

  FoundFile find_mesh(const xml::XMLElement& mesh) const {
    return find_resource(text_of(&mesh, "filename"), path_, options_.packages,
                         {compiler_.mesh_dir, compiler_.strip_path});
  }
  bool may_be_read(const FoundFile& found) const {
    return found.in_package || options_.allow_external_files || is_below(found.path, model_root(path_));
  }

  std::string add_mesh(const std::string& path, const Vec3& scale) {
    UrdfMesh mesh{path, scaled_mesh(path, scale)};
    constexpr double kFlat = 1e-6;
    if (mesh.data.flatness() < kFlat) {
      throw InputError("is flat, so that it has no convex hull; give it a thickness, or use a thin box");
    }
    std::string stem = fs::path(path).stem().string();
    std::ranges::replace(stem, '.', '_');  // MuJoCo takes what follows the last one for an ending
    std::string name = stem;
    for (int i = 2; result_.meshes.contains(name); ++i) name = fmt::format("{}_{}", stem, i);
    result_.meshes.emplace(name, std::move(mesh));
    return name;
  }

  void write() {
    if (result_.refused()) return;
    int line = 1;
    write_on_its_line(*robot_, line, result_.text);
    result_.text += '\n';
  }

  // ---- repair

  // Keeps with each element how many of its name begin in its line before it, while all are there.
  static void count_elements(xml::XMLElement& element, std::map<std::pair<int, std::string>, std::uintptr_t>& counted) {
    element.SetUserData(reinterpret_cast<void*>(counted[{element.GetLineNum(), element.Name()}]++));
    for (xml::XMLElement* e = element.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      count_elements(*e, counted);
    }
  }
  static int index_of(const xml::XMLElement& element) {
    return static_cast<int>(reinterpret_cast<std::uintptr_t>(element.GetUserData()));
  }

  static void change(const xml::XMLElement& element, const char* attribute, const std::string& value,
                     std::vector<AttributeEdit>& edits) {
    edits.push_back({element.GetLineNum(), index_of(element), element.Name(), attribute, value});
  }

  struct Repairs {
    std::vector<AttributeEdit> edits;
    std::vector<Mend> mends;
  };

  // Names of meshes that mean another file, or none, in the folder of `out`.
  void move_meshes(const std::string& out, std::vector<AttributeEdit>& edits, std::vector<Mend>& mends) const {
    size_t moved = 0;
    for (const Link& link : links_) {
      for (const char* kind : {"visual", "collision"}) {
        for (const xml::XMLElement* e = link.element->FirstChildElement(kind); e != nullptr;
             e = e->NextSiblingElement(kind)) {
          const xml::XMLElement* geometry = e->FirstChildElement("geometry");
          const xml::XMLElement* mesh = geometry == nullptr ? nullptr : geometry->FirstChildElement("mesh");
          const std::string uri = text_of(mesh, "filename");
          const MeshFolder as_mujoco{compiler_.mesh_dir, compiler_.strip_path};
          const std::string found = uri.empty() ? "" : find_resource(uri, path_, options_.packages, as_mujoco).path;
          if (found.empty() || find_resource(uri, out, options_.packages, as_mujoco).path == found) continue;
          change(*mesh, "filename", fs::absolute(found).lexically_normal().string(), edits);
          ++moved;
        }
      }
    }
    if (moved > 0) mends.push_back({0, fmt::format("names of mesh files that are absolute paths now: {}", moved)});
  }

  int heaviest_part(int head) const {
    int heaviest = head;
    for (size_t i = 0; i < links_.size(); ++i) {
      if (head_[i] == head && links_[i].mass > links_[heaviest].mass) heaviest = static_cast<int>(i);
    }
    return heaviest;
  }

  // Of a mass that fills the link's collision shapes, in the axes of its inertia; of a ball of water without such.
  Mat3 inertia_of_shapes(const Link& link, double mass) const {
    const std::vector<SolidShape> shapes = shapes_of(link);
    try {
      const RigidPart part = shapes.empty() ? RigidPart{} : part_of_shapes(shapes);
      const Mat3 R = link.X_LI.q.toRotationMatrix();
      const Mat3 I = part.mass > 0 ? Mat3(R.transpose() * part.I * R * (mass / part.mass)) : Mat3(Mat3::Zero());
      if (inertia_valid(I)) return I;
    } catch (const InputError&) {  // shapes that MuJoCo gives no mass
    }
    return nearest_valid_inertia(Mat3::Zero(), mass);
  }

  void mend_inertia(const Link& link, std::vector<AttributeEdit>& edits, std::vector<Mend>& mends) const {
    const xml::XMLElement* inertial = link.element->FirstChildElement("inertial");
    if (inertial == nullptr || link.mass <= 0) return;
    if (inertia_possible(link.I)) {
      // points and lines of mass are valid as parts, not as a whole: the heaviest part gets an extent
      const int head = head_[link_of_.at(link.name)];
      if (inertia_valid(whole_[head].I) || heaviest_part(head) != link_of_.at(link.name)) return;
    }
    const xml::XMLElement* inertia = inertial->FirstChildElement("inertia");
    const double mass = number_of(inertial->FirstChildElement("mass"), "value", 0);
    const Mat3 written = inertia_of(*inertial);
    const Mat3 mended = written.isZero(0) ? inertia_of_shapes(link, mass) : nearest_valid_inertia(written, mass);
    std::string entries;
    constexpr std::array<std::pair<const char*, std::pair<int, int>>, 6> kEntries = {
        {{"ixx", {0, 0}}, {"ixy", {0, 1}}, {"ixz", {0, 2}}, {"iyy", {1, 1}}, {"iyz", {1, 2}}, {"izz", {2, 2}}}};
    for (const auto& [name, at] : kEntries) {
      const double value = mended(at.first, at.second);
      entries += fmt::format(" {}=\"{}\"", name, shortest(value));
      if (inertia != nullptr && value != written(at.first, at.second)) change(*inertia, name, shortest(value), edits);
    }
    if (inertia == nullptr) {
      edits.push_back({.line = inertial->GetLineNum(),
                       .index = index_of(*inertial),
                       .element = "inertial",
                       .attribute = "",
                       .value = fmt::format("<inertia{}/>", entries)});
    }
    mends.push_back({(inertia == nullptr ? inertial : inertia)->GetLineNum(),
                     fmt::format("inertia of link '{}': principal moments {} -> {} kg m^2", link.name,
                                 inertia == nullptr ? "missing" : eigenvalues_text(principal_moments(written)),
                                 eigenvalues_text(principal_moments(mended)))});
  }

  void mend_joint(const UrdfJoint& joint, std::vector<AttributeEdit>& edits, std::vector<Mend>& mends) const {
    if (idle_.contains(link_joint(joint))) {
      change(*joint.element, "type", "fixed", edits);
      mends.push_back({line_of(joint), fmt::format("joint '{}' moves no mass: {} -> fixed", joint.name, joint.type)});
      return;
    }
    const xml::XMLElement* limit = joint.element->FirstChildElement("limit");
    if (limit == nullptr || (joint.type != "revolute" && joint.type != "prismatic")) return;
    const double lower = number_of(limit, "lower", 0), upper = number_of(limit, "upper", 0);
    if (lower <= upper || limit->Attribute("lower") == nullptr || limit->Attribute("upper") == nullptr) return;
    change(*limit, "lower", text_of(limit, "upper"), edits);
    change(*limit, "upper", text_of(limit, "lower"), edits);
    mends.push_back({limit->GetLineNum(), fmt::format("limits of joint '{}': swapped, {} to {}", joint.name,
                                                      shortest(upper), shortest(lower))});
  }

  int link_joint(const UrdfJoint& joint) const { return links_[joint.child].joint; }

  std::string path_;
  const LoadOptions& options_;
  xml::XMLDocument document_;
  xml::XMLElement* robot_ = nullptr;
  UrdfDocument result_;

  std::vector<Link> links_;
  std::vector<UrdfJoint> joints_;
  std::map<std::string, int> link_of_;
  std::vector<int> order_;                         // links, parents first
  std::vector<int> head_;                          // link -> the link that it is fixed to and that moves
  std::vector<Pose> X_HL_;                         // link -> its frame in its head's
  std::vector<RigidPart> whole_;                   // head -> all links that are fixed to it, in its frame
  std::set<int> idle_;                             // joints that move no mass
  std::map<std::string, std::string> mesh_names_;  // path and scale -> name
  UrdfCompiler compiler_;
  Repairs* repairs_ = nullptr;                  // while what has to change is gathered
  std::vector<std::pair<int, Vec3>> pictures_;  // links, and points of what is drawn of them, in the links' frames
};

}  // namespace

bool UrdfDocument::refused() const {
  return std::ranges::any_of(problems, [](const Problem& p) { return p.severity == Severity::kRefused; });
}

std::string root_element(const std::string& text) {
  xml::XMLDocument document;
  document.Parse(text.data(), text.size());
  return document.Error() || document.RootElement() == nullptr ? "" : document.RootElement()->Name();
}

UrdfDocument read_urdf(const std::string& text, const std::string& path, const LoadOptions& options) {
  return Reader(text, path, options).run();
}

std::string mend_urdf(const std::string& text, const std::string& path, const std::string& out,
                      std::vector<Mend>& mends, const LoadOptions& options) {
  Reader reader(text, path, options);
  return edited(text, reader.edits(out, mends));
}

}  // namespace assay
