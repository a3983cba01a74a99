#include "run/coordinator/rows.h"

#include <algorithm>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/json.h"
#include "controls/policy_config.h"
#include "engines/binary_facts.h"
#include "engines/builds.h"
#include "engines/describe.h"
#include "engines/registry.h"
#include "results/store/pictures.h"
#include "results/store/scene.h"

namespace assay {

using nlohmann::json;

json model_facts(const Model& model) {
  // "hinges" are hinges and slides
  return {{"model_hash", model.hash},
          {"dof", model.dof()},
          {"bodies", model.bodies.size()},
          {"hinges", model.joints.size()},
          {"slides", std::ranges::count_if(model.joints, &Joint::is_slide)},
          {"shapes", model.shapes.size()},
          {"contact_pairs", model.contacts.size()},
          {"mass_kg", model.total_mass()},
          {"gravity", {model.gravity.x(), model.gravity.y(), model.gravity.z()}}};
}

ContenderRow contender_row(const CampaignContender& contender) {
  const ResolvedContender& resolved = contender.resolved;
  if (resolved.engine == nullptr) {
    return {resolved.name, "", "", resolved.base, "", "{}", dump_json(json{{"absent", contender.absent}})};
  }
  const BuildFacts build = resolved.engine->build();
  const Capabilities can = resolved.engine->capabilities(resolved.settings);
  json capabilities = describe(can);
  capabilities["contact_forces_given"] = contact_forces_given(can.contact_forces);
  capabilities["changes"] = describe_changes(resolved.engine->settings(), resolved.settings);
  if (!contender.varies.empty()) capabilities["varies"] = contender.varies;
  const std::string engine = resolved.engine->name();
  json facts = {{"version", build.version}, {"source", build.source},          {"compiler", build.compiler},
                {"flags", build.flags},     {"plugin", contender.plugin_hash}, {"build", build_of(engine)}};
  if (json binary = binary_facts(Registry::instance().plugin_path(engine)); !binary.is_null()) {
    facts["binary"] = std::move(binary);
  }
  return {resolved.name,
          engine,
          build.version,
          resolved.base,
          settings_text(*resolved.engine, resolved.settings),
          dump_json(capabilities),
          dump_json(facts)};
}

SystemRow system_row(const CampaignSystem& system) {
  const Model& model = system.model;
  json row = model_facts(model);
  const bool is_of_packages = system.model_name.starts_with("robots:");
  row.update(system_content(system));
  row["model"] = is_of_packages ? system.model_name : std::filesystem::path(system.model_path).filename().string();
  row["contacts"] = system.variant.contacts && !system.variant.smooth;
  if (system.grasp.object >= 0) {
    row["grasp"] = {{"object", model.bodies[static_cast<size_t>(system.grasp.object)].name},
                    {"hand", model.bodies[static_cast<size_t>(system.grasp.hand)].name},
                    {"drop_m", system.grasp.drop_m}};
  }
  const ModelVariant& variant = system.variant;
  if (system.initial_states.count > 1) row["initial_states"] = initial_states_content(system.initial_states);
  if (system.load != LoadOptions()) {
    visit_load_fields(system.load, [&](const LoadField& field, const auto& value) {
      if (field.kept_at_default || !is_load_default(value)) row["load"][field.key] = value;
    });
  }
  if (variant.smooth) row["smooth"] = true;
  if (variant.above_ground_m >= 0) row["above_ground_m"] = variant.above_ground_m;
  if (variant.start_rates > 0) row["start_rates"] = variant.start_rates;
  for (const BodyPair& pair : variant.exclude) row["exclude"].push_back({pair.a, pair.b});
  if (!model.notes.empty()) row["notes"] = model.notes;
  // The --control option with which `assay simulate` drives the model in the same way; its default is the actuators.
  const bool unasked =
      system.control.kind == "actuators" || (model.actuators.empty() && make_control(model, system.control)->is_zero());
  if (!unasked) row["control_option"] = control_text(system.control);
  if (const auto control = make_control(model, system.control); control->policy() != nullptr) {
    row["trained_in"] = control->policy()->trained_in;
    row["trained_ms"] = 1e3 * control->policy()->train_timestep_s;
    row["shown_state"] = system.shown_state();
  }
  return {system.name, dump_json(row)};
}

SceneRow scene_row(const CampaignSystem& system, const Drawing& drawing) {
  constexpr size_t kDrawnTriangles = 24'000;  // of a robot
  Scene scene = scene_of(system.model);
  scene.control = system.control;
  json text = json::parse(scene_text(scene));
  for (size_t i = 0; i < system.model.shapes.size(); ++i) {
    if (!system.model.shapes[i].collides) text["shapes"][i]["collides"] = false;
  }
  Pictures pictures;
  for (const MeshData& mesh : drawing.meshes) pictures.meshes.push_back({mesh.vertices, mesh.faces});
  for (const DrawnPart& part : drawing.parts) pictures.parts.push_back({part.mesh, part.body, part.X_BS, part.rgba});
  simplify(pictures, kDrawnTriangles);
  if (!pictures.parts.empty()) text["pictures"] = pictures_json(pictures);
  return {system.name, dump_json(text)};
}

}  // namespace assay
