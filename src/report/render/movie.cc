#include "report/render/movie.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/exit_status.h"
#include "base/output_file.h"
#include "base/text.h"
#include "isolate/interruption.h"
#include "report/render/encoder.h"
#include "report/render/renderer.h"

namespace assay {
namespace {

using MovieClock = std::chrono::steady_clock;

// A reason in lines that a panel can show, each begun by a line break.
std::string reason_lines(const std::string& text) {
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

}  // namespace

int write_movie(const Scene& scene, const std::vector<Cell>& cells, const std::vector<MoviePart>& parts,
                const MovieRequest& request, ProgressLine& progress) {
  std::vector<const std::vector<State>*> runs;
  const std::vector<State>* longest = nullptr;
  std::vector<std::string> texts;
  for (const MoviePart& part : parts) {
    std::string text = part.contender;
    if (part.timestep_ms > 0) text += "\n" + figures_text(cells, request.system, part.contender, part.timestep_ms);
    texts.push_back(text);
    if (part.states.empty()) continue;
    runs.push_back(&part.states);
    if (longest == nullptr || part.states.size() > longest->size()) longest = &part.states;
  }
  if (longest != nullptr && longest->size() < 2 && request.of_kept_runs) {
    throw InputError(
        fmt::format("'{}' keeps only the last states of '{}': give --timestep to run it again, or use "
                    "'assay draw'",
                    request.dir, request.system));
  }
  if (longest == nullptr || longest->size() < 2) {
    throw InputError(fmt::format("no contender has a run of '{}' to show: {}: {}", request.system,
                                 parts.front().contender, parts.front().failure));
  }
  const double sample_ms = 1000 * ((*longest)[1].time - (*longest)[0].time);
  constexpr int kSlowest = 16;
  int slower = 1;
  while (slower < kSlowest &&
         slower * sample_ms * static_cast<double>(longest->size() - 1) < 1000 * request.slow_below_s) {
    slower *= 2;
  }
  const auto stride = static_cast<size_t>(std::max(1.0, std::round(kFrameMs / (slower * sample_ms))));
  const double frame_ms = slower * sample_ms * static_cast<double>(stride);
  const std::string speed = slower > 1 ? fmt::format(", at 1/{} of its speed", slower) : "";
  const size_t frames = (longest->size() - 1) / stride + 1;

  const int columns = grid_columns(static_cast<int>(parts.size()), request.width, request.height);
  std::error_code ignored;
  if (std::filesystem::is_directory(request.out, ignored)) {
    throw InputError(fmt::format("--out '{}' is a directory: give a file in it", request.out));
  }
  Partial partial(fresh_partial(request.out));
  Renderer renderer(scene, view_of(scene, runs), request.width, request.height, lettering(request.width / columns));
  {
    Encoder encoder(partial.path(), is_gif(request.out) ? Encoder::Format::kGif : Encoder::Format::kMp4, request.width,
                    request.height, frame_ms);
    const MovieClock::time_point start = MovieClock::now();
    for (size_t frame = 0; frame < frames; ++frame) {
      if (interrupted()) {
        progress.clear();
        message(fmt::format("interrupted at frame {} of {}", frame, frames));
        return exits::kFailed;
      }
      const size_t sample = frame * stride;
      std::vector<Panel> panels;
      panels.reserve(parts.size());
      for (size_t i = 0; i < parts.size(); ++i) {
        const std::vector<State>& states = parts[i].states;
        const bool over = sample >= states.size();
        const State* state = states.empty() ? nullptr : &states[std::min(sample, states.size() - 1)];
        panels.push_back({state, over ? texts[i] + reason_lines(parts[i].failure) : texts[i]});
      }
      encoder.write(renderer.draw(panels, columns, fmt::format("{:.2f} s{}", (*longest)[sample].time, speed)));
      if (!progress.due()) continue;
      const double elapsed = std::chrono::duration<double>(MovieClock::now() - start).count();
      const auto done = static_cast<double>(frame + 1);
      progress.show(fmt::format("frame {} of {}, {} left", frame + 1, frames,
                                duration_label(elapsed * (static_cast<double>(frames) - done) / done)));
    }
    encoder.finish();
  }
  progress.clear();
  partial.rename_to(request.out);
  message(fmt::format("'{}': {} of '{}', {} frames of {:.4g} ms{}", request.out, counted(parts.size(), "run"),
                      request.system, frames, frame_ms, speed));
  return exits::kDone;
}

}  // namespace assay
