// `assay movie`: contenders side by side on one clock.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/output_file.h"
#include "base/text.h"
#include "cli/cli.h"
#include "cli/pictures.h"
#include "report/render/encoder.h"
#include "results/line_up.h"
#include "results/store/trajectory.h"
#include "run/coordinator/rerun.h"

namespace assay::cli {
namespace {

using Clock = std::chrono::steady_clock;

constexpr size_t kMostPanels = 12;
constexpr double kFrameMs = 1000.0 / 30;  // frames are about this far apart where states are

struct MovieOptions {
  std::string dir, system, out, size = "1920x1080";
  std::vector<std::string> contenders;
  std::optional<std::string> timestep;
};

// One contender's part of the picture.
struct Part {
  std::string contender;
  double timestep_ms = 0;
  std::vector<State> states;
  std::string failure;
};

// Why a contender has no kept run: its reference's reason.
std::string reason_of(const std::vector<Cell>& cells, const std::string& system, const std::string& contender) {
  for (const Cell& cell : cells) {
    if (cell.system == system && cell.contender == contender && cell.measure == "reference" &&
        cell.outcome != Outcome::kOk) {
      return fmt::format("{} {}", outcome_text(cell.outcome), cell.reason);
    }
  }
  return "no kept run";
}

std::vector<Part> stored_parts(const Store& store, const Scene& scene, const std::vector<Cell>& cells,
                               const MovieOptions& options, const std::vector<std::string>& contenders) {
  std::vector<Part> parts;
  const std::vector<RunRow> runs = store.runs();
  for (const std::string& contender : contenders) {
    Part& part = parts.emplace_back();
    part.contender = contender;
    for (const RunRow& run : runs) {
      if (run.system != options.system || run.contender != contender || !part.states.empty()) continue;
      part.timestep_ms = run.timestep_ms;
      auto kept = read_run(store.trajectories_dir(), run.address, scene.bodies.size(), scene.joints.size());
      if (kept) part.states = std::move(kept->states);
    }
    if (part.states.empty()) part.failure = reason_of(cells, options.system, contender);
  }
  return parts;
}

std::vector<Part> new_parts(const Store& store, const Scene& scene, const MovieOptions& options,
                            const std::string& timestep, const std::vector<std::string>& contenders,
                            ProgressLine& progress) {
  const double timestep_ms = parse_positive("--timestep", timestep, "milliseconds");
  const double sample_ms = finer_sample_ms(store, options.system, timestep_ms, kFrameMs);
  std::vector<Part> parts;
  for (Rerun& rerun : run_again(store, options.system, contenders, timestep_ms, sample_ms, [&](size_t done) {
         if (!progress.due()) return;
         progress.show(fmt::format("{} of {} runs at {} ms", done, contenders.size(), timestep_label(timestep_ms)));
       })) {
    Part& part = parts.emplace_back();
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
std::vector<std::string> chosen(const Store& store, const MovieOptions& options) {
  std::vector<std::string> known, kept;
  for (const ContenderRow& row : store.contenders()) known.push_back(row.name);
  for (const RunRow& run : store.runs()) {
    if (run.system == options.system && has_trajectory(store.trajectories_dir(), run.address) &&
        std::ranges::find(kept, run.contender) == kept.end()) {
      kept.push_back(run.contender);
    }
  }
  if (options.contenders.empty()) {
    if (kept.empty()) throw InputError(fmt::format("'{}' keeps no run of '{}'", store.dir(), options.system));
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

// A reason in lines that a panel can show, each begun by a line break.
std::string wrapped(const std::string& text) {
  constexpr size_t kWidth = 40, kMostLines = 3;
  std::string out;
  size_t lines = 0;
  for (size_t at = 0; at < text.size() && lines < kMostLines; ++lines) {
    size_t length = std::min(kWidth, text.size() - at);
    const size_t space = text.rfind(' ', at + length);
    if (at + length < text.size() && space != std::string::npos && space > at) length = space - at;
    out += "\n" + text.substr(at, length);
    at += length + (at + length < text.size() && text[at + length] == ' ' ? 1 : 0);
  }
  return out;
}

int lettering(int panel_width) {
  constexpr int kSmall = 400, kLarge = 900;
  if (panel_width < kSmall) return 50;
  return panel_width < kLarge ? 100 : 150;
}

// A file that is removed unless it is finished.
class Partial {
 public:
  explicit Partial(std::string path) : path_(std::move(path)) {}
  ~Partial() {
    std::error_code ignored;
    if (!kept_) std::filesystem::remove(path_, ignored);
  }
  Partial(const Partial&) = delete;
  Partial& operator=(const Partial&) = delete;
  void rename_to(const std::string& name) {
    std::error_code error;
    std::filesystem::rename(path_, name, error);
    if (error) throw SystemError(fmt::format("'{}' cannot be written: {}", name, error.message()));
    kept_ = true;
  }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
  bool kept_ = false;
};

int movie(const MovieOptions& options) {
  const auto [width, height] = parse_size(options.size);
  const Store store = Store::open(options.dir);
  const Scene scene = scene_named(store, options.system);
  const std::vector<std::string> contenders = chosen(store, options);
  const std::vector<Cell> cells = store.cells();
  ProgressLine progress;
  watch_for_interruption();
  const std::vector<Part> parts = options.timestep
                                      ? new_parts(store, scene, options, *options.timestep, contenders, progress)
                                      : stored_parts(store, scene, cells, options, contenders);
  if (interrupted()) return kFailed;

  std::vector<const std::vector<State>*> runs;
  const std::vector<State>* longest = nullptr;
  std::vector<std::string> texts;
  for (const Part& part : parts) {
    std::string text = part.contender;
    if (part.timestep_ms > 0) text += "\n" + figures_text(cells, options.system, part.contender, part.timestep_ms);
    texts.push_back(text);
    if (part.states.empty()) continue;
    runs.push_back(&part.states);
    if (longest == nullptr || part.states.size() > longest->size()) longest = &part.states;
  }
  if (longest != nullptr && longest->size() < 2 && !options.timestep) {
    throw InputError(
        fmt::format("'{}' keeps only the last states of '{}': give --timestep to run it again, or use "
                    "'assay snapshot'",
                    options.dir, options.system));
  }
  if (longest == nullptr || longest->size() < 2) {
    throw InputError(fmt::format("no contender has a run of '{}' to show: {}: {}", options.system,
                                 parts.front().contender, parts.front().failure));
  }
  const double sample_ms = 1000 * ((*longest)[1].time - (*longest)[0].time);
  const auto stride = static_cast<size_t>(std::max(1.0, std::round(kFrameMs / sample_ms)));
  const double frame_ms = sample_ms * static_cast<double>(stride);
  const size_t frames = (longest->size() - 1) / stride + 1;

  const int columns = grid_columns(static_cast<int>(parts.size()), width, height);
  std::error_code ignored;
  if (std::filesystem::is_directory(options.out, ignored)) {
    throw InputError(fmt::format("--out '{}' is a directory: give a file in it", options.out));
  }
  Partial partial(fresh_partial(options.out));
  Renderer renderer(scene, view_of(scene, runs), width, height, lettering(width / columns));
  {
    Encoder encoder(partial.path(), width, height, frame_ms);
    const Clock::time_point start = Clock::now();
    for (size_t frame = 0; frame < frames; ++frame) {
      if (interrupted()) {
        progress.clear();
        message(fmt::format("interrupted at frame {} of {}", frame, frames));
        return kFailed;
      }
      const size_t sample = frame * stride;
      std::vector<Panel> panels;
      panels.reserve(parts.size());
      for (size_t i = 0; i < parts.size(); ++i) {
        const std::vector<State>& states = parts[i].states;
        const bool over = sample >= states.size();
        const State* state = states.empty() ? nullptr : &states[std::min(sample, states.size() - 1)];
        panels.push_back({state, over ? texts[i] + wrapped(parts[i].failure) : texts[i]});
      }
      encoder.write(renderer.draw(panels, columns, fmt::format("{:.2f} s", (*longest)[sample].time)));
      if (!progress.due()) continue;
      const double elapsed = std::chrono::duration<double>(Clock::now() - start).count();
      const auto done = static_cast<double>(frame + 1);
      progress.show(fmt::format("frame {} of {}, {} left", frame + 1, frames,
                                duration_label(elapsed * (static_cast<double>(frames) - done) / done)));
    }
    encoder.finish();
  }
  progress.clear();
  partial.rename_to(options.out);
  message(fmt::format("'{}': {} of '{}', {} frames of {:.4g} ms", options.out, counted(parts.size(), "contender"),
                      options.system, frames, frame_ms));
  return kDone;
}

}  // namespace

void add_movie(CLI::App& app, Action& action) {
  CLI::App* command =
      add_command(app, "movie", "Write an H.264 movie of contenders side by side",
                  {{"assay movie results humanoid --out humanoid.mp4", "from the kept runs of up to 12 contenders"},
                   {"assay movie results grasp --contenders mujoco-euler,havok --timestep 4 --out grasp.mp4",
                    "runs these contenders again at 4 ms"}});
  const auto options = std::make_shared<MovieOptions>();
  command->add_option("DIR", options->dir, "Results directory")->required()->type_name("");
  command->add_option("SYSTEM", options->system, "One of its systems")->required()->type_name("");
  command->add_option("--contenders", options->contenders, "Contenders to show, at most 12, separated by commas")
      ->delimiter(',')
      ->type_name("A,B,...")
      ->allow_extra_args(false);
  command
      ->add_option("--timestep", options->timestep,
                   "Runs again at this timestep, in ms (default: shows the kept runs at their own timestep)")
      ->type_name("MS");
  command->add_option("--size", options->size, "Pixels (default: 1920x1080)")->type_name("WIDTHxHEIGHT");
  command->add_option("--out", options->out, "MP4 file to write")->required()->type_name("FILE");
  command->callback([&action, options] { action = [options] { return movie(*options); }; });
}

}  // namespace assay::cli
