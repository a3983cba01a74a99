// `assay list`: the engines with their contenders, or the systems that come with assay. `assay engines` and `assay
// systems`, its names until 1.0, have the options of one of both.
#include <memory>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/json.h"
#include "base/paths.h"
#include "base/quantity.h"
#include "base/text.h"
#include "campaign/keys.h"
#include "cli/commands.h"
#include "engines/builds.h"
#include "engines/facts.h"
#include "engines/feature_table.h"
#include "engines/registry.h"
#include "engines/releases.h"
#include "engines/tables.h"
#include "load/mjcf.h"

namespace assay::cli {
namespace {

struct ListOptions {
  std::string what = "engines";
  bool json = false, features = false, builds = false, markdown = false;
};

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

// One row an engine and build, from its binary.
int list_builds(const ListOptions& options) {
  const EngineBuilds builds = engine_builds(Registry::instance());
  if (options.json) {
    print_json({{"builds", builds.facts}});
  } else {
    print(options.markdown ? builds.markdown() : builds.text());
  }
  return kDone;
}

int list_features(const ListOptions& options) {
  const Registry& registry = Registry::instance();
  std::vector<ResolvedContender> contenders;
  for (const std::string& name : registry.contender_names()) {
    if (name != "null") contenders.push_back(registry.resolve(name));
  }
  const std::vector<FeatureGroup> groups = feature_groups(contenders);
  if (options.json) {
    print_json(features_json(groups));
  } else {
    print(options.markdown ? features_markdown(groups) : features_text(groups));
  }
  return kDone;
}

int list_engines(bool as_json) {
  const Registry& registry = Registry::instance();
  std::vector<ResolvedContender> contenders;
  for (const std::string& name : registry.contender_names()) contenders.push_back(registry.resolve(name));

  if (as_json) {
    print_json(engines_json(contenders, registry.absent()));
    return kDone;
  }
  print(terminal_columns(stdout) ? tables_by_engine(contenders) : flat_table(contenders));
  for (const Engine* engine : registry.engines()) {
    const std::vector<std::string> known = releases_of(engine->name()), ready = releases_ready(engine->name());
    if (known.empty()) continue;
    print("\n" +
          paragraph(fmt::format("releases of {} as contenders, as {}@{}: {}; set up here: {}", engine->name(),
                                engine->contenders().front().name, known.front(), join(known, ", "),
                                ready.empty() ? "none (./assay setup " + in_build(engine->name(), known.front()) + ")"
                                              : join(ready, ", ")),
                    4));
  }
  if (!registry.absent().empty()) print("\n" + heading("not available") + ":\n");
  for (const AbsentEngine& engine : registry.absent()) {
    print(paragraph(fmt::format("  {}: {}", engine.name, engine.reason), 4));
  }
  return kDone;
}

int list_what_is_asked(const ListOptions& options) {
  if (options.what == "systems" || options.what == "campaign-keys") {
    if (options.features || options.builds) {
      throw InputError(
          fmt::format("--{} is of engines: give 'assay list engines'", options.features ? "features" : "builds"));
    }
    if (options.what == "systems") return list_systems(options.json);
    if (options.json)
      throw InputError("--json is of engines and systems: give 'assay list campaign-keys', a page in Markdown");
    print(campaign_keys_markdown());
    return kDone;
  }
  if (options.what != "engines") {
    const std::vector<std::string> known = {"engines", "systems", "campaign-keys"};
    throw InputError(fmt::format("there is no list of '{}'{}", options.what, did_you_mean(options.what, known)));
  }
  if (options.builds) return list_builds(options);
  return options.features ? list_features(options) : list_engines(options.json);
}

void add_engine_options(CLI::App& command, ListOptions& options) {
  CLI::Option* json = command.add_flag("--json", options.json, "Print JSON with all settings, capabilities and builds");
  json->disable_flag_override();
  CLI::Option* features =
      command.add_flag("--features", options.features, "Print the table of features of models and engines");
  features->disable_flag_override();
  CLI::Option* builds =
      command.add_flag("--builds", options.builds,
                       "Print how each engine was built: instruction sets, precision and assertions of its binary");
  builds->disable_flag_override()->excludes(features);
  command.add_flag("--markdown", options.markdown, "Print the table of --features or --builds for a document")
      ->disable_flag_override()
      ->excludes(json);
}

void run_list(CLI::App& command, Action& action, const std::shared_ptr<ListOptions>& options) {
  command.callback([&action, options] {
    if (options->markdown && !options->features && !options->builds) {
      throw CLI::RequiresError("--markdown", "--features or --builds");
    }
    action = [options] { return list_what_is_asked(*options); };
  });
}

}  // namespace

void add_list(CLI::App& app, Action& action) {
  CLI::App* command = add_command(
      app, "list", "List the engines with their contenders, the systems, or a campaign's keys",
      {{"assay list engines", "all contenders, and why an engine is absent"},
       {"assay list engines --features", "which parts of a model each engine has exactly, approximately or not"},
       {"assay list engines --builds", "instruction sets, precision and assertions of each engine's binary"},
       {"assay list systems", "bodies, degrees of freedom, shapes, contact pairs, mass"},
       {"ASSAY_DATA=~/lab assay list systems", "the models of ~/lab/models instead"},
       {"assay list campaign-keys", "each key of a campaign's file with an example, as Markdown"}});
  const auto options = std::make_shared<ListOptions>();
  command
      ->add_option("WHAT", options->what,
                   "engines (the default), systems, or campaign-keys: what a campaign's file may say")
      ->type_name("engines|systems|campaign-keys");
  add_engine_options(*command, *options);
  run_list(*command, action, options);
}

void add_engines(CLI::App& app, Action& action) {
  CLI::App* command = add_command(
      app, "engines", "List the engines and their contenders: until 1.0 another name of 'assay list engines'",
      {{"assay engines", "all contenders, and why an engine is absent"},
       {"assay engines --features", "which parts of a model each engine has exactly, approximately or not"},
       {"assay engines --builds", "instruction sets, precision and assertions of each engine's binary"},
       {"assay engines --json | jq '.contenders[].settings'", "every setting with its meaning"}});
  const auto options = std::make_shared<ListOptions>();
  add_engine_options(*command, *options);
  run_list(*command, action, options);
}

void add_systems(CLI::App& app, Action& action) {
  CLI::App* command =
      add_command(app, "systems", "List the systems (models) of assay: until 1.0 another name of 'assay list systems'",
                  {{"assay systems", "bodies, degrees of freedom, shapes, contact pairs, mass"},
                   {"ASSAY_DATA=~/lab assay systems", "the models of ~/lab/models instead"}});
  const auto options = std::make_shared<ListOptions>();
  options->what = "systems";
  command->add_flag("--json", options->json, "Print JSON")->disable_flag_override();
  run_list(*command, action, options);
}

}  // namespace assay::cli
