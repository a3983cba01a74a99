// `assay systems`: the models that come with assay.
#include <fmt/format.h>

#include "base/errors.h"
#include "base/json.h"
#include "base/paths.h"
#include "base/quantity.h"
#include "campaign/keys.h"
#include "cli/cli.h"
#include "engines/facts.h"
#include "load/mjcf.h"

namespace assay::cli {
namespace {

int list_systems(bool as_json) {
  Json json = Json::array();
  std::vector<std::vector<std::string>> rows;
  int status = kDone;
  for (const std::string& name : system_names()) {
    try {
      const Model model = load_model(find_model(name));
      const Json facts = model_json(name, model);
      const auto count = [&](const char* key) { return dump_json(facts.at(key)); };
      rows.push_back({name, count("bodies"), count("dof"), count("hinges"), count("free_joints"),
                      std::to_string(model.shapes.size()), count("contact_pairs"),
                      quantity_text(model.total_mass(), "kg")});
      json.push_back(facts);
    } catch (const InputError& error) {
      // one broken file does not hide the others
      message(error.what());
      status = kWrongInput;
    }
  }
  if (as_json) {
    print_json(Json{{"systems", json}});
  } else {
    print(table({"system", "bodies", "DOF", "hinges", "free joints", "shapes", "contact pairs", "mass"}, rows,
                {1, 2, 3, 4, 5, 6, 7}));
  }
  return status;
}

}  // namespace

void add_systems(CLI::App& app, Action& action) {
  CLI::App* command = add_command(app, "systems", "List the systems (models) that come with assay",
                                  {{"assay systems", "bodies, degrees of freedom, shapes, contact pairs, mass"},
                                   {"ASSAY_DATA=~/lab assay systems", "the models of ~/lab/models instead"}});
  const auto as_json = std::make_shared<bool>(false);
  command->add_flag("--json", *as_json, "Print JSON")->disable_flag_override();
  const auto keys = std::make_shared<bool>(false);
  command->add_flag("--campaign-keys", *keys, "Print docs/campaign-keys.md")->disable_flag_override()->group("");
  command->callback([&action, as_json, keys] {
    action = [as_json, keys] {
      if (!*keys) return list_systems(*as_json);
      print(campaign_keys_markdown());
      return kDone;
    };
  });
}

}  // namespace assay::cli
