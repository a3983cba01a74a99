#include "bisect/probes.h"

#include <algorithm>
#include <cmath>
#include <csignal>
#include <fcntl.h>
#include <filesystem>
#include <sstream>
#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>

#include "base/text.h"
#include "isolate/child.h"

namespace assay {
namespace {

constexpr size_t kColumns = 5;

std::vector<std::string> columns_of(const std::string& line) {
  std::vector<std::string> columns;
  std::istringstream text(line);
  for (std::string column; std::getline(text, column, '\t');) columns.push_back(column);
  return columns;
}

}  // namespace

ProbeRun run_probes(const std::string& plugin, double limit_s) {
  ProbeRun run;
  const std::string program = std::filesystem::path(plugin).parent_path() / "probes";
  if (std::error_code error; !std::filesystem::exists(program, error)) {
    run.failure = "there are no probes of this engine";
    return run;
  }
  Pipe ends = make_pipe();
  const pid_t child = start_child([&] {
    ::alarm(static_cast<unsigned>(std::ceil(limit_s)));
    ::dup2(ends.writing.get(), STDOUT_FILENO);
    ::dup2(::open("/dev/null", O_WRONLY | O_CLOEXEC), STDERR_FILENO);  // NOLINT(*-vararg)
    ::execl(program.c_str(), program.c_str(), nullptr);                // NOLINT(*-vararg)
    return 127;
  });
  ends.writing.close();
  const std::string said = read_to_end(ends.reading.get());
  const int status = wait_for(child);
  std::istringstream lines(said);
  for (std::string line; std::getline(lines, line);) {
    const std::vector<std::string> columns = columns_of(line);
    if (columns.size() != kColumns || columns[0] == "version") continue;
    const auto value = parse_number(columns[4]);
    if (value) run.values.push_back({columns[0], columns[1], columns[2], columns[3], *value});
  }
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM) {
    run.failure = fmt::format("probes took more than {:g} s", limit_s);
  } else if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    run.failure = fmt::format("probes ended early ({})", end_text(status));
  }
  return run;
}

std::vector<ProbeChange> probe_changes(const std::vector<ProbeValue>& before, const std::vector<ProbeValue>& after) {
  constexpr double kRelative = 1e-9, kAbsolute = 1e-12;
  std::vector<ProbeChange> changes;
  for (const ProbeValue& old : before) {
    const auto found = std::ranges::find_if(after, [&](const ProbeValue& each) {
      return each.probe == old.probe && each.condition == old.condition && each.quantity == old.quantity;
    });
    if (found == after.end()) continue;
    const double larger = std::max(std::abs(old.value), std::abs(found->value));
    if (std::abs(old.value - found->value) > std::max(kAbsolute, kRelative * larger))
      changes.push_back({old, found->value});
  }
  return changes;
}

std::string probe_change_text(const ProbeChange& change) {
  const ProbeValue& of = change.before;
  const std::string unit = of.unit.empty() || of.unit == "1" ? "" : " " + of.unit;
  return fmt::format("{} ({}): {} {:.4g} to {:.4g}{}", of.probe, of.condition, of.quantity, of.value, change.after,
                     unit);
}

}  // namespace assay
