#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/json.h"
#include "base/terminal.h"
#include "base/text.h"
#include "run/coordinator/run.h"

namespace assay {
namespace {

using Clock = std::chrono::steady_clock;

// What cannot be written (a full disk, a closed descriptor) is lost: the campaign is worth more than the word about it.
void put(FILE* stream, const std::string& text) {
  std::fwrite(text.data(), 1, text.size(), stream);
  std::fflush(stream);
}

class Counter {
 public:
  void begin(int todo, int done_before) {
    todo_ = todo;
    done_before_ = done_before;
    start_ = Clock::now();
  }
  void count() { ++done_; }
  int done() const { return done_before_ + done_; }
  int all() const { return done_before_ + todo_; }
  int done_now() const { return done_; }
  double elapsed_s() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }
  double share() const { return all() == 0 ? 1 : static_cast<double>(done()) / all(); }
  // "3.2 cells/s", "14 cells/min"
  std::string rate() const {
    const double per_second = elapsed_s() > 0 ? done_ / elapsed_s() : 0;
    return per_second >= 1 ? fmt::format("{:.1f} cells/s", per_second)
                           : fmt::format("{:.0f} cells/min", 60 * per_second);
  }

 private:
  int todo_ = 0, done_before_ = 0, done_ = 0;
  Clock::time_point start_ = Clock::now();
};

std::string opening(int todo, int done_before, double estimate_s) {
  std::string text = fmt::format("{} cells to measure", todo);
  if (done_before > 0) text += fmt::format(", {} are there already", done_before);
  if (todo > 0) text += fmt::format("; about {}", duration_label(std::max(1.0, estimate_s)));
  return text;
}

std::string tests_label(const std::string& last, int done, int all) {
  return fmt::format("{}/{} tests; last: {}", done, all, last);
}

class Bar final : public Progress {
 public:
  explicit Bar(FILE* stream) : stream_(stream) {}

  void plan(const std::vector<std::string>& lines) override {
    for (const std::string& each : lines) line(each);
  }
  void begin(int todo, int done_before, double estimate_s) override {
    line(opening(todo, done_before, estimate_s));
    counter_.begin(todo, done_before);
    remaining_s_ = estimate_s;
    draw(true);
  }
  void phase(const std::string& what) override {
    phase_ = what;
    current_.clear();
    draw(true);
  }
  void tested(const std::string& test, int done, int all) override {
    current_ = tests_label(test, done, all);
    draw(false);
  }
  void started(const std::string& cell, double remaining_s) override {
    current_ = cell;
    remaining_s_ = remaining_s;
    draw(false);
  }
  void finished(const Cell& /*cell*/, double remaining_s) override {
    counter_.count();
    remaining_s_ = remaining_s;
    draw(counter_.done() == counter_.all());
  }
  void made(const std::string& run, double remaining_s) override {
    current_ = run;
    remaining_s_ = remaining_s;
    draw(false);
  }
  void message(const std::string& text) override {
    line(text);
    draw(true);
  }
  void end() override { clear(); }

 private:
  static constexpr size_t kUsualColumns = 80, kWidestBar = 24, kLeastForRate = 64;

  void line(const std::string& text) {
    clear();
    for (const std::string& each : wrapped(text, columns(), 2)) {
      put(stream_, terminal_text(each, stream_) + "\n");
    }
  }

  size_t columns() const { return terminal_columns(stream_).value_or(kUsualColumns); }

  void clear() {
    put(stream_, drawn_ ? "\r\x1b[K" : "");
    drawn_ = false;
  }

  // At most ten times a second: a terminal must not slow the run.
  void draw(bool now) {
    constexpr double kInterval = 0.1;
    if (!now && std::chrono::duration<double>(Clock::now() - last_).count() < kInterval) return;
    last_ = Clock::now();
    const size_t width = columns(), bar = std::min(width / 5, kWidestBar);
    const auto filled = static_cast<size_t>(counter_.share() * static_cast<double>(bar));
    std::string text;
    if (counter_.all() > 0) {  // before that there is no plan yet
      text = fmt::format("[{}{}] {}/{}  ", std::string(filled, '='), std::string(bar - filled, ' '), counter_.done(),
                         counter_.all());
      const bool rate_is_known = counter_.done_now() > 0 && counter_.elapsed_s() > 1;
      if (rate_is_known && width >= kLeastForRate) text += counter_.rate() + "  ";
    }
    if (counter_.all() > 0 || remaining_s_ > 0) text += duration_label(std::max(0.0, remaining_s_)) + " left  ";
    text += phase_ + (phase_.empty() || current_.empty() ? "" : ": ") + current_;
    // a line that fills the last column would wrap on some terminals
    put(stream_, fmt::format("\r{}\x1b[K", terminal_text(clipped(text, width - 1), stream_)));
    drawn_ = true;
  }

  FILE* stream_;
  Counter counter_;
  std::string phase_, current_;
  double remaining_s_ = 0;
  Clock::time_point last_;
  bool drawn_ = false;
};

class Lines final : public Progress {
 public:
  Lines(FILE* stream, double interval_s) : stream_(stream), interval_s_(interval_s) {}

  void plan(const std::vector<std::string>& lines) override {
    for (const std::string& each : lines) line(each);
  }
  void begin(int todo, int done_before, double estimate_s) override {
    line(opening(todo, done_before, estimate_s));
    counter_.begin(todo, done_before);
    last_ = Clock::now();
  }
  void phase(const std::string& what) override { line(what); }
  void tested(const std::string& test, int done, int all) override {
    if (!is_time()) return;
    last_ = Clock::now();
    line(tests_label(test, done, all));
  }
  void started(const std::string& cell, double remaining_s) override {
    if (counter_.all() > 0 && is_time()) said("now: " + cell, remaining_s);
  }
  void finished(const Cell& cell, double remaining_s) override {
    counter_.count();
    if (is_time()) {
      said(fmt::format("last: {} {} {} at {} ms", cell.measure, cell.system, cell.contender,
                       timestep_label(cell.timestep_ms)),
           remaining_s);
    }
  }
  void made(const std::string& run, double remaining_s) override {
    if (is_time()) said("last: " + run, remaining_s);
  }
  void message(const std::string& text) override { line(text); }

 private:
  bool is_time() const { return std::chrono::duration<double>(Clock::now() - last_).count() >= interval_s_; }

  void said(const std::string& what, double remaining_s) {
    last_ = Clock::now();
    const std::string cells =
        counter_.all() == 0 ? "" : fmt::format("{}/{} cells, {}, ", counter_.done(), counter_.all(), counter_.rate());
    line(fmt::format("{}{} left; {}", cells, duration_label(std::max(0.0, remaining_s)), what));
  }

  void line(const std::string& text) {
    put(stream_, terminal_text(printable(text), stream_) + "\n");  // a name's newline would begin a line of its own
  }

  FILE* stream_;
  double interval_s_;
  Counter counter_;
  Clock::time_point last_ = Clock::now();
};

class JsonLines final : public Progress {
 public:
  explicit JsonLines(FILE* stream) : stream_(stream) {}

  void plan(const std::vector<std::string>& lines) override { line("plan", {{"lines", lines}}); }
  void begin(int todo, int done_before, double estimate_s) override {
    counter_.begin(todo, done_before);
    line("begin", {{"cells", counter_.all()}, {"done", counter_.done()}, {"left_s", std::max(0.0, estimate_s)}});
  }
  void phase(const std::string& what) override { line("phase", {{"text", what}}); }
  void tested(const std::string& test, int done, int all) override {
    line("tested", {{"tests", all}, {"tests_done", done}, {"text", test}});
  }
  void started(const std::string& cell, double remaining_s) override {
    line("started", {{"left_s", std::max(0.0, remaining_s)}, {"text", cell}});
  }
  void finished(const Cell& cell, double remaining_s) override {
    counter_.count();
    line("finished", {{"cells", counter_.all()},
                      {"done", counter_.done()},
                      {"left_s", std::max(0.0, remaining_s)},
                      {"measure", cell.measure},
                      {"system", cell.system},
                      {"contender", cell.contender},
                      {"timestep_ms", cell.timestep_ms},
                      {"outcome", outcome_text(cell.outcome)}});
  }
  void made(const std::string& run, double remaining_s) override {
    line("made", {{"left_s", std::max(0.0, remaining_s)}, {"text", run}});
  }
  void message(const std::string& text) override { line("message", {{"text", text}}); }
  void end() override { line("end", nlohmann::ordered_json::object()); }

 private:
  void line(const char* event, const nlohmann::ordered_json& more) {
    nlohmann::ordered_json whole = {{"event", event}};
    whole.update(more);
    put(stream_, dump_json(whole) + "\n");
  }

  FILE* stream_;
  Counter counter_;
};

}  // namespace

std::unique_ptr<Progress> make_json_progress(FILE* stream) { return std::make_unique<JsonLines>(stream); }

std::unique_ptr<Progress> make_progress(FILE* stream, double interval_s) {
  if (terminal_columns(stream)) return std::make_unique<Bar>(stream);
  return std::make_unique<Lines>(stream, interval_s);
}

}  // namespace assay
