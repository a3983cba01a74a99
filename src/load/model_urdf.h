// A model as the text of a URDF file, and what URDF cannot say of it.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "model/model.h"

namespace assay {

struct WrittenUrdf {
  struct Mesh {
    std::string file;  // as the text names it: "meshes/hull0.stl"
    std::string stl;   // binary
  };
  std::string text;
  std::vector<Mesh> meshes;
  std::vector<std::string> left_out;  // a sentence each: what the text lacks
};

// The text from which load_model_text() reads the same robot but for what `left_out` names. Every link's frame lies at
// its joint, with the axes of the body's frame; capsules are a cylinder and two spheres. Throws InputError for
// ball joints, which URDF does not have. Meshes are for the caller to write: the text has them
// below the folder `mesh_folder`; `velocity_limits` (rad/s, m/s, by joint) are those of a file that has some.
WrittenUrdf model_urdf(const Model& model, const std::string& mesh_folder,
                       const std::map<std::string, double>& velocity_limits = {});

// The model with positions measured from 0: at 0 every joint has its body at X_PB (Joint::reference is 0).
Model from_zero(Model model);

}  // namespace assay
