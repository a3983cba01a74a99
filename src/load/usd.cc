#include "load/usd.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <csignal>
#include <cstdlib>
#include <fcntl.h>
#include <filesystem>
#include <optional>
#include <regex>
#include <string_view>
#include <sys/wait.h>
#include <system_error>
#include <unistd.h>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/input_file.h"
#include "base/json.h"
#include "base/paths.h"
#include "isolate/child.h"
#include "isolate/processes.h"
#include "isolate/sandbox.h"
#include "load/outside_files.h"

namespace assay {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct Module {
  const char* name;
  const char* text;
};

// In the order in which they import each other.
constexpr std::array<Module, 6> kModules = {{
    {
        "geometry",
#include "usd_geometry.inc"
    },
    {
        "stage",
#include "usd_stage.inc"
    },
    {
        "shapes",
#include "usd_shapes.inc"
    },
    {
        "robot",
#include "usd_robot.inc"
    },
    {
        "document",
#include "usd_document.inc"
    },
    {
        "read",
#include "usd_read.inc"
    },
}};

// The arguments are the task and the modules. Nothing but the answer reaches standard output, whatever libraries print.
constexpr const char* kStart = R"python(
import json, os, sys, types
out = os.dup(1)
os.dup2(2, 1)
try:
    for name, text in zip(sys.argv[2::2], sys.argv[3::2]):
        module = sys.modules[name] = types.ModuleType(name)
        exec(compile(text, name + ".py", "exec"), module.__dict__)
    answer = module.main(json.loads(sys.argv[1]))
except ImportError as error:
    answer = json.dumps({"missing": str(error)})
except BaseException as error:
    at = error.__traceback__
    while at.tb_next:
        at = at.tb_next
    answer = json.dumps({"failed": f"{type(error).__name__} in {at.tb_frame.f_code.co_filename}, line {at.tb_lineno}: {error}"})
with os.fdopen(out, "w", encoding="utf-8", errors="replace") as stream:
    stream.write(answer)
)python";

constexpr const char* kInterpreterVariable = "ASSAY_USD_PYTHON";

std::string interpreter() {
  if (const char* given = std::getenv(kInterpreterVariable); given != nullptr && *given != '\0') return given;
  return (fs::path(cache_dir()) / "python" / ASSAY_USD_ENVIRONMENT / "bin" / "python").string();
}

[[noreturn]] void throw_not_set_up(const std::string& path) {
  throw InputError(fmt::format(
      "'{}' is USD, and the library that reads it (usd-core, 210 MB) is not set up: run ./assay setup usd, or "
      "name a Python that has usd-core in {}",
      path, kInterpreterVariable));
}

// The folders of a virtual environment and of the interpreter behind it.
void add_environment(const std::string& python, std::vector<std::string>& readable) {
  std::error_code error;
  for (const fs::path& program : {fs::absolute(python, error), fs::canonical(python, error)}) {
    const fs::path folder = program.parent_path().parent_path();
    if (folder.has_relative_path()) readable.push_back(folder.string());
  }
}

// What the process says; its end as waitpid() gives it.
std::pair<std::string, int> asked(const std::string& python, const json& task, const SandboxRules& rules) {
  std::vector<std::string> words = {python, "-I", "-B", "-c", kStart, dump_json(task)};
  for (const Module& module : kModules) {
    words.emplace_back(module.name);
    words.emplace_back(module.text);
  }
  // isolated from the user's packages and plugins; one thread, as a file is small
  const std::array<const char*, 5> environment = {"PYTHONHASHSEED=0", "PYTHONDONTWRITEBYTECODE=1", "LC_ALL=C.UTF-8",
                                                  "PXR_WORK_THREAD_LIMIT=1", nullptr};
  std::vector<const char*> arguments;
  arguments.reserve(words.size() + 1);
  for (const std::string& word : words) arguments.push_back(word.c_str());
  arguments.push_back(nullptr);
  Pipe output = make_pipe();
  const pid_t child = start_child([&] {
    const int nothing = ::open("/dev/null", O_RDWR | O_CLOEXEC);
    ::dup2(nothing, STDIN_FILENO);
    ::dup2(nothing, STDERR_FILENO);
    ::dup2(output.writing.get(), STDOUT_FILENO);
    ::signal(SIGPIPE, SIG_DFL);
    enter_sandbox(rules);
    ::execve(python.c_str(), const_cast<char* const*>(arguments.data()), const_cast<char* const*>(environment.data()));
    constexpr int kCannotExec = 127;
    return kCannotExec;
  });
  output.writing.close();
  std::string text = read_to_end(output.reading.get());
  return {std::move(text), wait_for(child)};
}

std::vector<std::string> strings(const json& answer, const char* key) {
  const auto found = answer.find(key);
  return found == answer.end() ? std::vector<std::string>() : found->get<std::vector<std::string>>();
}

// ---- the last file, which a command may read several times -------------------------------------------------------------

struct Kept {
  std::string path;
  bool allow_external = false, drop = false;
  std::vector<std::pair<std::string, fs::file_time_type>> layers;
  UsdDocument document;
};

std::vector<std::pair<std::string, fs::file_time_type>> times_of(const std::vector<std::string>& files) {
  std::vector<std::pair<std::string, fs::file_time_type>> times;
  std::error_code error;
  times.reserve(files.size());
  for (const std::string& file : files) times.emplace_back(file, fs::last_write_time(file, error));
  return times;
}

std::optional<Kept>& kept_document() {
  static thread_local std::optional<Kept> last;
  return last;
}

bool is_kept(const std::string& path, const LoadOptions& options) {
  const std::optional<Kept>& last = kept_document();
  if (!last || last->path != path || last->allow_external != options.allow_external_files ||
      last->drop != options.drop_unsupported) {
    return false;
  }
  std::error_code error;
  return std::ranges::all_of(last->layers, [&](const auto& layer) {
    return fs::last_write_time(layer.first, error) == layer.second && !error;
  });
}

}  // namespace

bool UsdDocument::refused() const {
  return std::ranges::any_of(problems, [](const Problem& each) { return each.severity == Severity::kRefused; });
}

void UsdDocument::place(Problem& problem) const {
  problem.line = 0;
  problem.file.clear();
  problem.message = without_lines(problem.message);
  // "geom 2 of body 'foot'" is where the body is
  const size_t kind = problem.element.find("body '");
  auto found = prims.find(problem.element);
  if (found == prims.end() && kind != std::string::npos) found = prims.find(problem.element.substr(kind));
  if (found != prims.end()) problem.element += " " + found->second;
}

std::string UsdDocument::without_lines(const std::string& message) {
  static const std::regex kLine(R"( \(line \d+\)|,? ?\bline \d+)");
  return std::regex_replace(message, kLine, "");
}

bool is_usd(const std::string& path) {
  std::string ending = fs::path(path).extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending == ".usd" || ending == ".usda" || ending == ".usdc" || ending == ".usdz";
}

UsdDocument read_usd(const std::string& path, const LoadOptions& options) {
  if (is_kept(path, options)) return kept_document()->document;
  std::error_code error;
  if (fs::file_size(path, error) > kMostModelFileBytes) {
    throw InputError(
        fmt::format("'{}' has more than {} MiB: leave out what is only drawn", path, kMostModelFileBytes >> 20));
  }
  const std::string python = interpreter();
  if (!fs::exists(python, error)) throw_not_set_up(path);
  const std::string file = (model_folder(path) / fs::path(path).filename()).string(), root = model_root(path);
  SandboxRules rules = {.read_everything = options.allow_external_files,
                        .readable = {root, fs::weakly_canonical(file, error).string()}};
  add_environment(python, rules.readable);
  const json task = {{"path", file},
                     {"root", root},
                     {"allow_external", options.allow_external_files},
                     {"drop_unsupported", options.drop_unsupported}};
  const auto [text, end] = asked(python, task, rules);
  share_end(end);
  const json answer = json::parse(text, nullptr, false);
  if (WIFSIGNALED(end)) {
    const int signal = WTERMSIG(end);
    throw InputError(
        signal == SIGXCPU
            ? fmt::format("reading '{}' was stopped: OpenUSD takes too much processor time", path)
            : fmt::format("reading '{}' ended OpenUSD with {}: it cannot be used", path, signal_text(signal)));
  }
  if (!answer.is_object()) {
    throw SystemError(fmt::format("the process that reads '{}' cannot be started ({}, {}): run ./assay setup usd again",
                                  path, python, end_text(end)));
  }
  if (answer.contains("missing")) throw_not_set_up(path);
  if (answer.contains("failed")) {
    throw InputError(fmt::format("'{}' is USD that cannot be read: {}", path, answer.at("failed").get<std::string>()));
  }
  UsdDocument document;
  document.notes = strings(answer, "notes");
  for (const json& each : answer.at("problems")) {
    document.problems.push_back({.severity = each.at("left_out").get<bool>() ? Severity::kLeftOut : Severity::kRefused,
                                 .element = each.at("element").get<std::string>(),
                                 .message = each.at("message").get<std::string>(),
                                 .mend = each.at("mend").get<std::string>(),
                                 .option = each.at("option").get<std::string>()});
  }
  if (answer.contains("places")) document.prims = answer.at("places").get<std::map<std::string, std::string>>();
  if (answer.contains("mjcf")) {
    document.text = answer.at("mjcf").get<std::string>();
    kept_document() = Kept{path, options.allow_external_files, options.drop_unsupported,
                           times_of(strings(answer, "layers")), document};
  }
  return document;
}

}  // namespace assay
