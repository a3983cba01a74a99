// An SDF document while it is read: its models with all that they include, as frames, links and joints of one list
// each, and what was found so far. The other files here work on it one after the other (load/sdf.cc).
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <tinyxml2.h>

#include "load/load_options.h"
#include "load/sdf.h"
#include "model/geometry.h"

namespace assay::sdf {

// One file of the document.
struct Source {
  std::string path;  // empty for a text
  std::string name;  // as the <include> writes it that names it; empty for the model's own
  int depth = 0;     // of includes around it
  int version = 0;   // of the format: 104 is 1.4, 110 is 1.10
  tinyxml2::XMLDocument document;
};

struct Element {
  const tinyxml2::XMLElement* at = nullptr;
  const Source* source = nullptr;

  int line() const { return at == nullptr ? 0 : at->GetLineNum(); }
  Element child(const char* name) const;
  // The next element of that name beside it.
  Element next(const char* name) const;
  explicit operator bool() const { return at != nullptr; }
};

// A model, the world, or nothing but a place for names.
struct Scope {
  std::string path;  // before its names: "" or "arm::"
  std::string name;
  int parent = -1;
  int frame = 0;  // its own: the model's implicit frame, or the world's
  int top = -1;   // the scope of the outermost model that it is in; its own for that; -1 for the world
  bool is_static = false;
  bool self_collide = false;
  std::map<std::string, int> frames;    // explicit frames, links and joints
  std::map<std::string, int> children;  // nested models
  std::string canonical;                // canonical_link
  std::vector<int> links;               // its own
  std::vector<int> nested;              // its children in the file's order
};

struct Frame {
  enum class Kind { kWorld, kModel, kLink, kJoint, kFrame };
  Kind kind = Kind::kFrame;
  std::string name;  // "joint 'arm::elbow'", for messages
  int scope = 0;     // in which `relative_to` and `attached_to` are looked up
  int index = -1;    // of the scope, link or joint
  Element element = {};
  std::string relative_to = {}, attached_to = {};
  Pose raw = {};               // relative to `base`
  std::string placement = {};  // placement_frame of a model, or of an include
  int model = -1;  // the frame that "__model__" means here: that of the scope, or of what was merged into it
  // filled in by resolve()
  int base = -1, attached = -1, placed = -1;
};

struct Link {
  std::string name;  // with its scope
  int scope = 0, frame = 0;
  Element element;
  bool is_static = false, self_collide = false;
  RigidPart part;  // in the link's frame
  bool has_gravity = true;
  std::vector<SdfShape> shapes;  // X_BS in the link's frame
  Pose X_WL;
};

struct Axis {
  bool is_there = false;
  Vec3 axis_W = Vec3::UnitZ();
  double lower = -std::numeric_limits<double>::infinity(), upper = std::numeric_limits<double>::infinity();
  double effort = std::numeric_limits<double>::infinity(), velocity = std::numeric_limits<double>::infinity();
  double stiffness = 0, spring_reference = 0, damping = 0, dry_friction = 0;
  struct Mimic {
    std::string joint, axis;
    double multiplier = 1, offset = 0;  // the reference is part of the offset
    int line = 0;
  };
  std::optional<Mimic> mimic;
  std::optional<double> held;  // position at which it is fixed
  std::string coordinate;      // name of the joint that it becomes
};

struct Joint {
  std::string name, type;
  int scope = 0, frame = 0;
  Element element;
  int parent = -1, child = -1;  // links; -1: the world
  Pose X_WJ;
  std::array<Axis, 2> axes;
  double pitch = 0;    // of a screw, m/rad
  int reference = -2;  // gearbox: the reference body; -1: the world
  double ratio = 1;
};

// `options` has to outlive it.
struct Robot {
  Robot(std::string from, const LoadOptions& how) : path(std::move(from)), options(how) {}

  void refuse(const std::string& part, const Element& where, std::string message, std::string mend,
              std::string option = "");
  // Refused, or with --drop-unsupported left out; `costs`: "is left out, so that ...". True where it is left out.
  bool unsupported(const std::string& part, const Element& where, const std::string& message, const std::string& mend,
                   const std::string& costs);
  void note(std::string text) { result.parts.notes.push_back(std::move(text)); }
  std::string place(const Element& where) const;  // "line 3", "arm.sdf, line 3"
  // A line for MuJoCo's spec; what lies in an included file goes by its label, "joint 'knee'".
  int line_of(const std::string& label, const Element& where);

  // ---- values with their faults; the element itself, null where it is not there
  double number(const Element& element, double otherwise, const std::string& owner);
  double number(const Element& parent, const char* name, double otherwise, const std::string& owner) {
    return number(parent.child(name), otherwise, owner);
  }
  bool truth(const Element& element, bool otherwise, const std::string& owner);
  Vec3 vector(const Element& element, const Vec3& otherwise, const std::string& owner);
  std::vector<double> numbers(const Element& element, size_t count, const std::string& owner);
  Pose pose(const Element& element, const std::string& owner);

  std::string path;
  const LoadOptions& options;
  std::vector<std::unique_ptr<Source>> sources;
  std::vector<Scope> scopes;
  std::vector<Frame> frames;  // the first is the world's
  std::vector<Link> links;
  std::vector<Joint> joints;
  SdfDocument result;
};

// ---- models.cc: the elements of the document and of what it includes. False where nothing more can be read.
bool read_models(Robot& robot, const std::string& text);
// May a file be read: below the model's folder, in a trusted package, or with --allow-external-files.
bool may_read(const Robot& robot, const std::string& file, bool in_package);

// ---- frames.cc
// Finds what names of frames mean, and all poses. False where one has no meaning.
bool resolve_frames(Robot& robot);
// The index of a frame by its name in a scope ("link", "arm::link", "__model__", "world"); -1 where there is none.
int find_frame(const Robot& robot, int scope, const std::string& name, int model);
// The link that a frame is attached to, -1 for the world, -2 where there is none.
int attached_link(const Robot& robot, int frame);
// A frame's pose in the world.
Pose pose_of(const Robot& robot, int frame);

// ---- the others, in this order
void read_shapes(Robot& robot);
void read_masses(Robot& robot);
void read_joints(Robot& robot);
void build_tree(Robot& robot);
void note_unread_parts(Robot& robot);

}  // namespace assay::sdf
