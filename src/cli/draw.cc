// `assay draw`: a state as a PNG picture, or contenders side by side as a movie. `assay snapshot` and `assay movie`,
// its names until 1.0, have the options of one of both.
#include <algorithm>
#include <memory>
#include <optional>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/option_values.h"
#include "base/output_file.h"
#include "base/paths.h"
#include "base/text.h"
#include "cli/commands.h"
#include "cli/model_options.h"
#include "engines/facts.h"
#include "load/mjcf.h"
#include "match/folder.h"
#include "report/render/movie.h"
#include "report/render/renderer.h"
#include "report/render/shots.h"
#include "results/line_up.h"
#include "results/store/trajectory.h"
#include "run/coordinator/rerun.h"

namespace assay::cli {
namespace {

struct DrawOptions {
  std::vector<std::string> where;              // MODEL, or DIR SYSTEM
  ModelOptions load;                           // without its MODEL
  std::optional<std::string> contender, time;  // of a picture
  std::vector<std::string> contenders;         // of a movie
  std::optional<std::string> timestep;
  std::optional<std::string> size;
  std::string out;
};

constexpr double kShownLeastS = 2;  // a measured motion that is shorter is shown slowly

bool is_movie(const std::string& out) { return out.ends_with(".mp4") || is_gif(out); }

std::pair<int, int> parse_size(const std::string& text) {
  constexpr int kLeast = 16, kMost = 8192;
  const size_t cross = text.find('x');
  if (cross != std::string::npos) {
    const auto width = parse_integer(text.substr(0, cross)), height = parse_integer(text.substr(cross + 1));
    const auto fine = [](long long side) { return side >= kLeast && side <= kMost && side % 2 == 0; };
    if (width && height && fine(*width) && fine(*height)) {
      return {static_cast<int>(*width), static_cast<int>(*height)};
    }
  }
  throw InputError(fmt::format("--size is '{}': give WIDTHxHEIGHT in pixels, even numbers from {} to {}, as 1280x720",
                               text, kLeast, kMost));
}

Shot model_shot(const DrawOptions& options) {
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

int picture(const DrawOptions& options) {
  const auto [width, height] = parse_size(options.size.value_or("1280x960"));
  const Shot shot = options.where.size() == 1
                        ? model_shot(options)
                        : kept_shot(Store::open(options.where[0]), options.where[1], options.contender, options.time);
  OutputFile file(options.out);
  Renderer renderer(shot.scene, view_of(shot.scene, {&shot.states}), width, height);
  file.write(png_bytes(renderer.draw({{.state = &shot.states[shot.shown], .text = ""}})));
  file.finish();
  return kDone;
}

std::vector<MoviePart> new_parts(const Store& store, const Scene& scene, const DrawOptions& options,
                                 const std::string& timestep, const std::vector<std::string>& contenders,
                                 ProgressLine& progress) {
  const double timestep_ms = parse_positive("--timestep", timestep, "milliseconds");
  const double sample_ms = finer_sample_ms(store, options.where[1], timestep_ms, kFrameMs);
  std::vector<MoviePart> parts;
  for (Rerun& rerun : run_again(store, options.where[1], contenders, timestep_ms, sample_ms, [&](size_t done) {
         if (!progress.due()) return;
         progress.show(fmt::format("{} of {} runs at {} ms", done, contenders.size(), timestep_label(timestep_ms)));
       })) {
    MoviePart& part = parts.emplace_back();
    part.contender = rerun.contender;
    part.timestep_ms = timestep_ms;
    part.failure = rerun.failure;
    if (!rerun.trajectory) continue;
    const std::string fault = run_fault(*rerun.trajectory, scene.bodies.size(), scene.joints.size());
    if (fault.empty()) {
      part.states = std::move(rerun.trajectory->states);
    } else if (part.failure.empty()) {
      part.failure = "the run " + fault;
    }
  }
  return parts;
}

// The contenders of --contenders, else those of the line-up that have a kept run.
std::vector<std::string> shown_contenders(const Store& store, const DrawOptions& options) {
  const std::string& system = options.where[1];
  std::vector<std::string> known, kept;
  for (const ContenderRow& row : store.contenders()) known.push_back(row.name);
  for (const RunRow& run : store.runs()) {
    if (run.system == system && has_trajectory(store.trajectories_dir(), run.address) &&
        std::ranges::find(kept, run.contender) == kept.end()) {
      kept.push_back(run.contender);
    }
  }
  if (options.contenders.empty()) {
    if (kept.empty()) throw InputError(fmt::format("'{}' keeps no run of '{}'", store.dir(), system));
    return line_up(kept, kMostPanels);
  }
  std::vector<std::string> names;
  for (const std::string& name : options.contenders) {
    if (std::ranges::find(known, name) == known.end()) {
      throw InputError(fmt::format("'{}' has no contender '{}'{}", store.dir(), name, did_you_mean(name, known)));
    }
    if (std::ranges::find(names, name) == names.end()) names.push_back(name);
  }
  if (names.size() > kMostPanels) {
    throw InputError(
        fmt::format("--contenders names {} contenders: a movie shows at most {}", names.size(), kMostPanels));
  }
  return names;
}

int movie(const DrawOptions& options) {
  const std::string& system = options.where[1];
  const auto [width, height] = parse_size(options.size.value_or(is_gif(options.out) ? "960x540" : "1920x1080"));
  const Store store = Store::open(options.where[0]);
  const Scene scene = scene_named(store, system);
  const std::vector<std::string> contenders = shown_contenders(store, options);
  ProgressLine progress;
  watch_for_interruption();
  const std::vector<MoviePart> parts = options.timestep
                                           ? new_parts(store, scene, options, *options.timestep, contenders, progress)
                                           : stored_parts(store, scene, system, contenders);
  if (interrupted()) return kFailed;
  const MovieRequest request{.dir = options.where[0],
                             .system = system,
                             .out = options.out,
                             .width = width,
                             .height = height,
                             .of_kept_runs = !options.timestep};
  return write_movie(scene, store.cells(), parts, request, progress);
}

// Measured motion next to what contenders make of it: `where` is a folder of assay match, and a log or its role.
struct MotionShown {
  std::string log;
  Scene scene;
  std::vector<MoviePart> parts;  // what was measured first
};

MotionShown motion_shown(const DrawOptions& options) {
  const std::string &dir = options.where[0], &name = options.where[1];
  const nlohmann::json motion = match::read_motion(dir);
  if (motion.is_null() || motion.at("logs").empty()) {
    throw InputError(fmt::format("'{}' keeps no motion yet: let `assay match` end, or start it again", dir));
  }
  const nlohmann::json* log = match::kept_log_named(motion, name);
  std::vector<std::string> names, contenders;
  for (const nlohmann::json& each : motion.at("logs")) {
    for (const nlohmann::json& role : each.at("roles")) names.push_back(role.get<std::string>());
    names.push_back(each.at("log").get<std::string>());
  }
  if (log == nullptr) {
    throw InputError(fmt::format("'{}' keeps no motion of '{}': it has {}{}", dir, name, join(names, ", "),
                                 did_you_mean(name, names)));
  }
  for (const nlohmann::json& run : log->at("runs")) {
    const auto contender = run.at("contender").get<std::string>();
    if (contender != match::kMeasured && std::ranges::find(contenders, contender) == contenders.end()) {
      contenders.push_back(contender);
    }
  }
  for (const std::string& wanted : options.contenders) {
    if (std::ranges::find(contenders, wanted) == contenders.end()) {
      throw InputError(fmt::format("'{}' keeps no motion of '{}': it has {}{}", dir, wanted, join(contenders, ", "),
                                   did_you_mean(wanted, contenders)));
    }
  }
  MotionShown shown{log->at("log").get<std::string>(), parse_scene(motion.at("scene").dump()), {}};
  for (const nlohmann::json& run : log->at("runs")) {
    const auto contender = run.at("contender").get<std::string>();
    const bool measured = contender == match::kMeasured, fitted = run.at("fitted").get<bool>();
    const bool asked = options.contenders.empty()
                           ? fitted || contender == contenders.front()
                           : std::ranges::find(options.contenders, contender) != options.contenders.end();
    if (!measured && !asked) continue;
    shown.parts.push_back({.contender = measured ? contender : contender + (fitted ? ", fitted" : ", untuned"),
                           .states = match::motion_states(dir, motion, run),
                           .failure = run.at("ended").get<std::string>()});
  }
  if (shown.parts.front().states.empty()) {
    throw InputError(
        fmt::format("'{}' has no states of '{}' to draw: its log does not say where all bodies are", dir, shown.log));
  }
  return shown;
}

int motion_movie(const DrawOptions& options) {
  if (options.timestep) throw InputError("--timestep runs contenders of a campaign again: leave it out for a match");
  const auto [width, height] = parse_size(options.size.value_or(is_gif(options.out) ? "960x540" : "1920x1080"));
  const MotionShown shown = motion_shown(options);
  ProgressLine progress;
  watch_for_interruption();
  const MovieRequest request{.dir = options.where[0],
                             .system = shown.log,
                             .out = options.out,
                             .width = width,
                             .height = height,
                             .slow_below_s = kShownLeastS};
  return write_movie(shown.scene, {}, shown.parts, request, progress);
}

int draw(const DrawOptions& options) {
  const bool of_match = options.where.size() == 2 && match::is_match_folder(options.where[0]);
  if (!is_movie(options.out)) {
    if (!options.contenders.empty() || options.timestep) {
      throw InputError(fmt::format("--{} is for a movie: give --out a name that ends in .mp4 or .gif",
                                   options.timestep ? "timestep" : "contenders"));
    }
    if (of_match)
      throw InputError("motion of a match is drawn as a movie: give --out a name that ends in .mp4 or .gif");
    return picture(options);
  }
  if (options.contender || options.time) {
    throw InputError(fmt::format("--{} is for a picture: give --out a name that does not end in .mp4 or .gif",
                                 options.contender ? "contender" : "time"));
  }
  if (options.where.size() != 2) throw InputError("a movie shows measured runs: give a results directory and a system");
  return of_match ? motion_movie(options) : movie(options);
}

void add_picture_options(CLI::App& command, DrawOptions& options) {
  command.add_option("--contender", options.contender, "Contender of the run (default: the first run that is kept)")
      ->type_name("CONTENDER");
  command
      .add_option("--time", options.time, "Seconds since the start; draws the nearest kept state (default: the first)")
      ->type_name("S");
  add_load_options(command, options.load);
}

void add_movie_options(CLI::App& command, DrawOptions& options) {
  command.add_option("--contenders", options.contenders, "Contenders to show, at most 12, separated by commas")
      ->delimiter(',')
      ->type_name("A,B,...")
      ->allow_extra_args(false);
  command
      .add_option("--timestep", options.timestep,
                  "Runs again at this timestep, in ms (default: shows the kept runs at their own timestep)")
      ->type_name("MS");
}

void add_size_and_out(CLI::App& command, DrawOptions& options, const char* size, const char* out) {
  command.add_option("--size", options.size, size)->type_name("WIDTHxHEIGHT");
  command.add_option("--out", options.out, out)->required()->type_name("FILE");
}

}  // namespace

std::optional<std::vector<std::string>> drawing_folders(const CLI::App& command) {
  const bool film = command.get_name() == "movie" || is_movie(command.get_option("--out")->as<std::string>());
  return film && command.get_name() != "snapshot" ? std::nullopt : written_folders(command);
}

void add_draw(CLI::App& app, Action& action) {
  CLI::App* command = add_command(
      app, "draw", "Draw a state as a picture, or contenders side by side as a movie",
      {{"assay draw humanoid --out humanoid.png", "the initial state of a model"},
       {"assay draw results humanoid --contender ode-quick --time 1.5 --out fallen.png", "a state of a kept run"},
       {"assay draw results humanoid --out humanoid.mp4", "a movie of the kept runs of up to 12 contenders"},
       {"assay draw matched worst --out worst.mp4",
        "measured motion next to what contenders make of it, after assay match"},
       {"assay draw results grasp --contenders mujoco-euler,havok --timestep 4 --out grasp.gif",
        "runs these contenders again at 4 ms"}});
  const auto options = std::make_shared<DrawOptions>();
  command
      ->add_option("WHERE", options->where,
                   "A model (file or system's name), a results directory and a system, or a folder of assay match and "
                   "worst, median, separating or a log that it keeps")
      ->required()
      ->expected(1, 2)
      ->type_name("MODEL|DIR SYSTEM");
  add_picture_options(*command, *options);
  add_movie_options(*command, *options);
  add_size_and_out(*command, *options, "Pixels (default: 1280x960, of an MP4 file 1920x1080, of a GIF 960x540)",
                   "PNG file to write ('-': standard output), or a movie by its ending: .mp4, or .gif");
  command->callback([&action, options] { action = [options] { return draw(*options); }; });
}

void add_snapshot(CLI::App& app, Action& action) {
  CLI::App* command = add_command(
      app, "snapshot", "Draw a state as a PNG picture: until 1.0 another name of 'assay draw'",
      {{"assay snapshot humanoid --out humanoid.png", "the initial state of a model"},
       {"assay snapshot results humanoid --contender ode-quick --time 1.5 --out fallen.png", "a state of a kept run"}});
  const auto options = std::make_shared<DrawOptions>();
  command->add_option("WHERE", options->where, "A model (file or system's name), or a results directory and a system")
      ->required()
      ->expected(1, 2)
      ->type_name("MODEL|DIR SYSTEM");
  add_picture_options(*command, *options);
  add_size_and_out(*command, *options, "Pixels (default: 1280x960)", "PNG file to write; '-' is standard output");
  command->callback([&action, options] { action = [options] { return picture(*options); }; });
}

void add_movie(CLI::App& app, Action& action) {
  CLI::App* command = add_command(
      app, "movie", "Write an H.264 movie of contenders side by side: until 1.0 another name of 'assay draw'",
      {{"assay movie results humanoid --out humanoid.mp4", "from the kept runs of up to 12 contenders"},
       {"assay movie results grasp --contenders mujoco-euler,havok --timestep 4 --out grasp.mp4",
        "runs these contenders again at 4 ms"}});
  const auto options = std::make_shared<DrawOptions>();
  options->where.resize(2);
  command->add_option("DIR", options->where[0], "Results directory")->required()->type_name("");
  command->add_option("SYSTEM", options->where[1], "One of its systems")->required()->type_name("");
  add_movie_options(*command, *options);
  add_size_and_out(*command, *options, "Pixels (default: 1920x1080)", "MP4 or GIF file to write");
  command->callback([&action, options] { action = [options] { return movie(*options); }; });
}

}  // namespace assay::cli
