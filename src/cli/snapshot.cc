// `assay snapshot`: a state as a PNG file.
#include <cmath>
#include <memory>
#include <optional>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/output_file.h"
#include "base/paths.h"
#include "base/text.h"
#include "cli/cli.h"
#include "cli/model_options.h"
#include "cli/pictures.h"
#include "load/mjcf.h"
#include "results/store/trajectory.h"

namespace assay::cli {
namespace {

struct SnapshotOptions {
  std::vector<std::string> where;  // MODEL, or DIR SYSTEM
  ModelOptions load;               // without its MODEL
  std::optional<std::string> contender, time;
  std::string size = "1280x960", out;
};

struct Shot {
  Scene scene;
  std::vector<State> states;  // that the view is chosen for
  size_t shown = 0;           // index into them
};

Shot of_model(const SnapshotOptions& options) {
  if (options.contender || options.time) {
    throw InputError(fmt::format("--{} selects a stored run: give a results directory and a system instead of a model",
                                 options.contender ? "contender" : "time"));
  }
  LoadOptions how = load_options(options.load);
  how.drop_unsupported = true;
  const Model model = load_model(find_model(options.where.front()), how);
  tell_notes(model);
  return {scene_of(model), {model.initial}, 0};
}

Shot of_results(const SnapshotOptions& options) {
  const Store store = Store::open(options.where[0]);
  const std::string& system = options.where[1];
  Shot shot{scene_named(store, system), {}, 0};
  std::vector<std::string> kept;
  for (const RunRow& run : store.runs()) {
    if (run.system != system || !has_trajectory(store.trajectories_dir(), run.address)) continue;
    kept.push_back(run.contender);
    if (!shot.states.empty() || (options.contender && *options.contender != run.contender)) continue;
    const Scene& scene = shot.scene;
    auto trajectory = read_run(store.trajectories_dir(), run.address, scene.bodies.size(), scene.joints.size());
    if (trajectory) shot.states = std::move(trajectory->states);
  }
  if (shot.states.empty()) {
    if (!options.contender) throw InputError(fmt::format("'{}' keeps no run of '{}'", store.dir(), system));
    throw InputError(fmt::format("'{}' keeps no run of '{}' on '{}'{}", store.dir(), *options.contender, system,
                                 did_you_mean(*options.contender, kept)));
  }
  if (shot.states.size() == 1) {
    message(fmt::format("note: of this run only the state at {} s is kept", shortest(shot.states.back().time)));
  }
  if (options.time) {
    const double last = shot.states.back().time;
    const auto time = parse_number(*options.time);
    if (!time || *time < 0 || *time > last * (1 + 1e-9)) {
      throw InputError(fmt::format("--time is '{}': give seconds from 0 to {}, the length of the run", *options.time,
                                   shortest(last)));
    }
    for (size_t i = 0; i < shot.states.size(); ++i) {
      if (std::abs(shot.states[i].time - *time) < std::abs(shot.states[shot.shown].time - *time)) shot.shown = i;
    }
  }
  return shot;
}

int snapshot(const SnapshotOptions& options) {
  const auto [width, height] = parse_size(options.size);
  const Shot shot = options.where.size() == 1 ? of_model(options) : of_results(options);
  OutputFile file(options.out);
  Renderer renderer(shot.scene, view_of(shot.scene, {&shot.states}), width, height);
  file.write(png_bytes(renderer.draw({{.state = &shot.states[shot.shown], .text = ""}})));
  file.finish();
  return kDone;
}

}  // namespace

void add_snapshot(CLI::App& app, Action& action) {
  CLI::App* command = add_command(
      app, "snapshot", "Draw a state as a PNG picture",
      {{"assay snapshot humanoid --out humanoid.png", "the initial state of a model"},
       {"assay snapshot results humanoid --contender ode-quick --time 1.5 --out fallen.png", "a state of a kept run"}});
  const auto options = std::make_shared<SnapshotOptions>();
  command->add_option("WHERE", options->where, "A model (file or system's name), or a results directory and a system")
      ->required()
      ->expected(1, 2)
      ->type_name("MODEL|DIR SYSTEM");
  command->add_option("--contender", options->contender, "Contender of the run (default: the first run that is kept)")
      ->type_name("CONTENDER");
  command
      ->add_option("--time", options->time,
                   "Seconds since the start; draws the nearest kept state (default: the first)")
      ->type_name("S");
  add_load_options(*command, options->load);
  command->add_option("--size", options->size, "Pixels (default: 1280x960)")->type_name("WIDTHxHEIGHT");
  command->add_option("--out", options->out, "PNG file to write; '-' is standard output")
      ->required()
      ->type_name("FILE");
  command->callback([&action, options] { action = [options] { return snapshot(*options); }; });
}

}  // namespace assay::cli
