// URDF in front of MuJoCo's parser, which reads only a part of it as URDF means it. This reads the document, finds its
// mistakes with their lines, resolves files, and writes the document that the parser gets: the same elements on the
// same lines, with these differences.
// - Mesh files become names; the entry (mjcf.cc) gives MuJoCo their vertices.
// - A link without <inertial> has no mass, as URDF says (MuJoCo would take its shapes' volume). Moving ones get a
//   placeholder and are named in `massless`.
// - Where links that are fixed to each other could not be compiled one by one (a mass without inertia), the inertia of
//   the whole stands in the link that moves.
// - A continuous joint has no limits; a missing bound of another is 0; <mimic> of a fixed joint is dropped.
// - A joint with equal limits is fixed there. A robot in which nothing could move has a free base.
// - Nothing that is only drawn is in it, and of <mujoco> only <option>: what <compiler> means is done here.
// URDF has no actuators: every joint that moves and mimics no other is driven by a motor within its effort limit.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "load/inertia.h"
#include "load/load_options.h"
#include "load/mesh_file.h"
#include "load/problems.h"
#include "load/text_edit.h"

namespace assay {

// A collision mesh as it is compiled: scaled, in the geometry's frame.
struct UrdfMesh {
  std::string path;
  MeshData data;
};

struct UrdfDocument {
  std::string text;                           // for MuJoCo's parser
  std::map<std::string, UrdfMesh> meshes;     // by the name of their <mesh> in `text`, without ending
  std::set<std::string> massless;             // bodies whose inertia is a placeholder
  std::map<std::string, RigidPart> inertia;   // bodies whose inertia is too small for MuJoCo: theirs, in their frame
  std::map<std::string, double> starts;       // joints that start elsewhere than at 0
  std::map<std::string, double> locked;       // joints that their equal limits hold, and where
  std::map<std::string, double> drawn_reach;  // FileFacts::drawn_reach
  std::map<std::string, double> velocity_limits;  // by joint: rad/s, m/s; nothing here applies them
  std::vector<std::string> driven;                // joints that get a motor, whose force the effort limit clamps
  bool has_mass = false;                          // any link
  std::vector<std::string> notes;
  std::map<std::string, int> lines;  // of links and joints: "body 'foot'", "joint 'knee'"
  std::vector<Problem> problems;

  bool refused() const;
};

// The note of a robot that gets a free base because nothing else in it could move.
inline constexpr const char* kFreeObject = "its base is free, because nothing else could move (--fixed-base holds it)";

// The document's root element: "robot", "mujoco", "sdf"; empty when it is no XML.
std::string root_element(const std::string& text);

// `path` is where the text comes from, for relative names. Every problem is found, not only the first.
UrdfDocument read_urdf(const std::string& text, const std::string& path, const LoadOptions& options);

// The text without the faults that have one obvious mend, for mended_model().
std::string mend_urdf(const std::string& text, const std::string& path, const std::string& out,
                      std::vector<Mend>& mends, const LoadOptions& options);

}  // namespace assay
