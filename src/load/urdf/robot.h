// A URDF document while it is read: its elements as links and joints, and what was found so far. The pieces of the
// reader, the other files here, work on it one after the other (urdf.cc).
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include <tinyxml2.h>

#include "load/load_options.h"
#include "load/text_edit.h"
#include "load/urdf.h"
#include "load/urdf/compiler.h"
#include "model/geometry.h"

namespace assay::urdf {

struct Link {
  tinyxml2::XMLElement* element = nullptr;
  std::string name;
  int joint = -1;             // to its parent; -1 for the root
  std::vector<int> children;  // joints
  double mass = 0;
  Mat3 I = Mat3::Zero();  // about the centre of mass, in the axes of X_LI
  Pose X_LI;              // inertial frame in the link's
  bool computed = false;  // mass and inertia are not those that the document writes
};

struct Joint {
  tinyxml2::XMLElement* element = nullptr;
  std::string name, type;
  int parent = -1, child = -1;
};

int line_of(const Joint& joint);
std::string label(const Joint& joint);
void set_type(Joint& joint, const char* type);

// For an attribute, with all digits.
std::string triple(const Vec3& v);

// What to do about arguments of xacro.
inline constexpr const char* kExpand = "expand the file first, with xacro";

// `how` has to outlive it.
struct Robot {
  Robot(const std::string& text, std::string from, const LoadOptions& how);

  void refuse(const std::string& part, int line, std::string message, std::string mend, std::string option = "");
  void leave_out(const std::string& part, int line, const std::string& message);
  void note(std::string text) { result.notes.push_back(std::move(text)); }

  bool moves(const Link& link) const { return link.joint >= 0 && joints[link.joint].type != "fixed"; }
  // The link and all that hang on it, however deep.
  std::vector<int> tree_of(int root) const;
  // Mass that a joint moves. A negative one counts: that is another fault.
  double carried_mass(int link) const;
  bool carries_shapes(int link) const;

  std::string path;
  const LoadOptions& options;
  tinyxml2::XMLDocument document;
  tinyxml2::XMLElement* element = nullptr;  // <robot>
  std::vector<Link> links;
  std::vector<Joint> joints;
  std::map<std::string, int> link_of;
  std::vector<int> order;  // links, parents first
  UrdfCompiler compiler;
  UrdfDocument result;
};

// What has to change in the text for it to be valid.
struct Repairs {
  std::vector<AttributeEdit> edits;
  std::vector<Mend> mends;

  void change(const tinyxml2::XMLElement& element, const char* attribute, const std::string& value);
};

// How many elements of its name begin in its line before it, in the document as it was written.
int index_of(const tinyxml2::XMLElement& element);

}  // namespace assay::urdf
