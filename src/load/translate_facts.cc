// Where the elements of the Model are in the file.
#include <fmt/format.h>

#include "load/translator.h"

namespace assay {

void Translator::fill_places(FileFacts& facts) const {
  const auto add = [&](const char* kind, const std::string& own, const FilePlace& at) {
    if (at.line <= 0) return;
    const std::string label = fmt::format("{} '{}'", kind, own);
    if (facts.lines.emplace(label, at.line).second && !at.file.empty()) facts.files.emplace(label, at.file);
  };
  for (size_t i = 0; i < model_.bodies.size(); ++i) {
    const Body& body = model_.bodies[i];
    add("body", body.name, place(mjOBJ_BODY, mujoco_body_[i]));
    const FilePlace at = place(mjOBJ_JOINT, joint_of_[i]);
    if (body.joint >= 0) add("joint", model_.joints[body.joint].name, at);
    if (body.ball >= 0) add("joint", model_.balls[body.ball].name, at);
  }
  for (int g = 0; g < m_->ngeom; ++g) {
    if (shape_of_[g] >= 0) add("geom", model_.shapes[shape_of_[g]].name, place(mjOBJ_GEOM, g));
  }
  for (size_t i = 0; i < model_.actuators.size(); ++i) {
    add("actuator", model_.actuators[i].name, place(mjOBJ_ACTUATOR, actuator_of_[i]));
  }
  for (int t = 0; t < m_->ntendon; ++t) add("tendon", name(mjOBJ_TENDON, t), place(mjOBJ_TENDON, t));
  for (int e = 0; e < m_->neq; ++e) {
    const std::string own = name(mjOBJ_EQUALITY, e);
    for (const char* kind : {"coupling", "connect", "weld"}) {
      add(kind, own.empty() ? fmt::format("equality{}", e + 1) : own, place(mjOBJ_EQUALITY, e));
    }
  }
}

}  // namespace assay
